// Adapts the noise of pixels, and that of depth, to what the triangulations leave over: log-domain moving average,
// clamped, adopted by the next image. Each by its own rows, so that a wrong noise model of the one does not leak into
// the other.
#pragma once

#include <Eigen/Core>

namespace vip_slam {

class NoiseMonitor {
 public:
  /// Begins with `sigma`, px for pixels, for depth a factor on the sensor's noise model.
  NoiseMonitor(double sigma, double lowest, double highest, bool adapt);
  /// `chi2_per_dof`: squared residuals whitened by sigma() over their degrees of freedom; `dof` rows behind it.
  void add(double chi2_per_dof, int dof);
  double sigma() const { return sigma_; }

 private:
  double sigma_, min_, max_;
  bool adapt_;
  int updates_ = 0;
};

/// How far the stamps of images scatter about the times at which they were taken, when the host stamps them. A camera
/// that turns shows it at once: the updates turn the predicted pose to and fro about the axis about which it turns
/// anyway, by more than the covariance shrinks by them.
class StampMonitor {
 public:
  explicit StampMonitor(bool adapt) : adapt_(adapt) {}
  /// `omega`: rate of turn, rad/s; `turned`: what the update made of the predicted orientation, a rotation vector, rad;
  /// `lost`: by how much its covariance shrank, rad^2. All in the body frame.
  void add(const Eigen::Vector3d& omega, const Eigen::Vector3d& turned, const Eigen::Matrix3d& lost);
  double sigma() const { return sigma_; }  ///< s; 0 while the stamps are as good as one can tell
  /// The corrections are not explained yet, and may still be by the stamps.
  bool isGrowing() const;
  void reset();

 private:
  bool adapt_;
  double sigma_ = 0, ratio_ = 0.5;
};

/// Widens the IMU's noise when the images contradict it by more than both admit: by the corrections they make to the
/// predicted motion, which should scatter as the covariance shrinks by them, or when the gate turns away far more
/// features than its probability explains. Then the prediction is surer of itself than it should be (noise figures from
/// a data sheet, vibration, stamps). Narrows again when all is well.
class ImuNoiseMonitor {
 public:
  explicit ImuNoiseMonitor(bool adapt) : adapt_(adapt) {}
  /// `correction`: squared correction of the predicted motion per degree of freedom, whitened by what the covariance
  /// shrank; honest: 1, less when the pixels' noise is rated high to be safe.
  void add(double correction, int used, int gated);
  double scale() const { return scale_; }
  void reset();

 private:
  bool adapt_;
  double scale_ = 1.0, gated_ratio_ = 0.05, correction_ = 0.5;
};

}  // namespace vip_slam
