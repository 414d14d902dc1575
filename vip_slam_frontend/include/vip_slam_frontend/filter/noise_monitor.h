// Adapts the pixel noise to what the triangulations leave over: log-domain moving average, clamped, adopted by the
// next image. Pixels only, so that a wrong depth noise model does not leak into it.
#pragma once

namespace vip_slam {

class NoiseMonitor {
 public:
  NoiseMonitor(double sigma_px, double min_px, double max_px, bool adapt);
  /// `chi2_per_dof`: squared pixel residuals whitened by sigma() over their degrees of freedom; `dof` rows behind it.
  void add(double chi2_per_dof, int dof);
  double sigma() const { return sigma_; }

 private:
  double sigma_, min_, max_;
  bool adapt_;
  int updates_ = 0;
};

/// Widens the IMU's noise when the gate turns away far more features than its probability explains: then the prediction
/// is surer of itself than it should be (noise figures from a data sheet, vibration). Narrows again when all is well.
class ImuNoiseMonitor {
 public:
  explicit ImuNoiseMonitor(bool adapt) : adapt_(adapt) {}
  void add(int used, int gated);
  double scale() const { return scale_; }
  void reset();

 private:
  bool adapt_;
  double scale_ = 1.0, gated_ratio_ = 0.05;
};

}  // namespace vip_slam
