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
};

}  // namespace vip_slam
