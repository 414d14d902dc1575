// How far a feature's pixel is off. A track is aligned with the patch that it started from or, when the view has
// changed too much for that, with a later one: each change of patch leaves an error that all later views share. Against
// true poses the error grows from a tenth of a pixel in the first keyframes to one pixel after ten, and that is the
// model:
//   sigma^2 = pixel_sigma^2 + (pixel_creep * keyframes since the landmark's first)^2, at most max_pixel_sigma.
#pragma once

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_core/types/feature.h"

namespace vip_slam {

class PixelNoise {
 public:
  PixelNoise(const MeasurementOptions& options, double focal);

  /// One sigma in normalised coordinates. `order`: place among the landmark's observations, 0 for the first.
  double sigma(const Feature& feature, int order) const;
  /// Errors are judged as outliers against at least this sigma, normalised: whoever weighs marks by a tenth of a pixel
  /// must not throw away what a camera's calibration leaves.
  double gateSigma() const { return gate_sigma_; }

 private:
  double first_, creep_, most_, matched_, gate_sigma_;  // normalised
};

}  // namespace vip_slam
