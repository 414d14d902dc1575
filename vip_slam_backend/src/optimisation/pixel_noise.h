// How far a feature's pixel is off. The front end tells it for each track (its tracking/pixel_noise.h): a tenth of a
// pixel where the depth shows the surface that the patch lies on, several times that where it does not.
#pragma once

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_core/types/feature.h"

namespace vip_slam {

class PixelNoise {
 public:
  PixelNoise(const MeasurementOptions& options, double focal);

  /// One sigma in normalised coordinates.
  double sigma(const Feature& feature) const;
  /// Errors are judged as outliers against at least this sigma, normalised: whoever weighs marks by a tenth of a pixel
  /// must not throw away what a camera's calibration leaves.
  double gateSigma() const { return gate_sigma_; }

 private:
  double focal_, least_, most_, matched_, gate_sigma_;  // but for focal_ normalised
};

}  // namespace vip_slam
