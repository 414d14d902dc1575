// SPDX-License-Identifier: BSD-3-Clause
// Adapts the noise of pixels, and that of depth, to the residuals of triangulation: log-domain moving average,
// used from the next image on. Each uses its own rows, so that a wrong noise model of the one does not affect the
// other.
#pragma once

#include <algorithm>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

class NoiseMonitor {
 public:
  /// `sigma`: initial value, for pixels in px, for depth a factor on the sensor's noise model.
  /// At most as many times that as a gate has sigmas: beyond it readings are wrong rather than noisy.
  NoiseMonitor(double sigma, double lowest)
      : sigma_(std::max(sigma, lowest)), min_(lowest), max_(kGateSigmas * sigma_) {}
  /// `chi2_per_dof`: squared residuals whitened by sigma() over their degrees of freedom; `dof` rows behind it.
  void add(double chi2_per_dof, int dof);
  double sigma() const { return sigma_; }

 private:
  double sigma_, min_, max_;
  int updates_ = 0;
};

/// Raises the IMU's noise when the images contradict it by more than the noise of both explains: when the corrections
/// of the predicted motion are larger than the decrease of its covariance. Then the prediction is overconfident
/// (data-sheet noise, vibration, stamps). The noise goes down again when the corrections are smaller.
class ImuNoiseMonitor {
 public:
  explicit ImuNoiseMonitor(bool adapt) : adapt_(adapt) {}
  /// `correction`: squared correction of the predicted motion per degree of freedom, whitened by the decrease of the
  /// covariance; 1 when consistent, less when the pixels' noise is inflated to be safe.
  void add(double correction, int features);
  double scale() const { return scale_; }
  void reset();

 private:
  bool adapt_;
  double scale_ = 1.0, correction_ = 0.5;
};

}  // namespace vip_slam
