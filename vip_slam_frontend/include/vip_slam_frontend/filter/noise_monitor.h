// SPDX-License-Identifier: BSD-3-Clause
// Adapts the noise of pixels, and that of depth, to the residuals of triangulation: log-domain moving average, clamped,
// used from the next image on. Each uses its own rows, so that a wrong noise model of the one does not affect the
// other.
#pragma once

#include <Eigen/Core>

namespace vip_slam {

class NoiseMonitor {
 public:
  /// `sigma`: initial value, for pixels in px, for depth a factor on the sensor's noise model.
  NoiseMonitor(double sigma, double lowest, double highest);
  /// `chi2_per_dof`: squared residuals whitened by sigma() over their degrees of freedom; `dof` rows behind it.
  void add(double chi2_per_dof, int dof);
  double sigma() const { return sigma_; }

 private:
  double sigma_, min_, max_;
  int updates_ = 0;
};

/// Estimates the jitter of the images' stamps against the times at which they were taken, as when the host stamps them.
/// It shows while the camera rotates: updates correct the predicted rotation to and fro about the rotation axis, by
/// more than the covariance shrinks.
class StampMonitor {
 public:
  explicit StampMonitor(bool adapt) : adapt_(adapt) {}
  /// `omega`: angular rate, rad/s; `turned`: the update's correction of the predicted orientation, a rotation vector,
  /// rad; `lost`: decrease of its covariance by the update, rad^2. All in the body frame.
  void add(const Eigen::Vector3d& omega, const Eigen::Vector3d& turned, const Eigen::Matrix3d& lost);
  double sigma() const { return sigma_; }  ///< s; 0 while no jitter is measurable
  /// Whether the corrections are still larger than explained, and more stamp jitter may explain them.
  bool isGrowing() const;
  void reset();

 private:
  bool adapt_;
  double sigma_ = 0, ratio_ = 0.5;
};

/// Raises the IMU's noise when the images contradict it by more than the noise of both explains: when the corrections
/// of the predicted motion are larger than the decrease of its covariance, or when the gate rejects far more features
/// than its probability explains. Then the prediction is overconfident (data-sheet noise, vibration, stamps). The noise
/// goes down again when the residuals are consistent.
class ImuNoiseMonitor {
 public:
  explicit ImuNoiseMonitor(bool adapt) : adapt_(adapt) {}
  /// `correction`: squared correction of the predicted motion per degree of freedom, whitened by the decrease of the
  /// covariance; 1 when consistent, less when the pixels' noise is inflated to be safe.
  void add(double correction, int used, int gated);
  double scale() const { return scale_; }
  void reset();

 private:
  bool adapt_;
  double scale_ = 1.0, gated_ratio_ = 0.05, correction_ = 0.5;
};

}  // namespace vip_slam
