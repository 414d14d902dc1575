// How far a feature's pixel is off. The front end tells it for each track (its tracking/pixel_noise.h): a tenth of a
// pixel where the depth shows the surface that the patch lies on, several times that where it does not. That is how far
// the views of a track scatter about the point that its reference patch shows; the patch of another track of the same
// landmark shows a point beside it.
#pragma once

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_core/types/feature.h"

namespace vip_slam {

class PixelNoise {
 public:
  PixelNoise(const MeasurementOptions& options, double focal);

  /// One sigma of a view of a point, in normalised coordinates. `own_track`: of the point's track. Else `apart` tells
  /// how far apart the corners of the two tracks are here, as a factor on the error of one where it was detected: what
  /// is half a pixel from afar is more from near by.
  double sigma(const Feature& feature, bool own_track, double apart) const;
  /// Errors are judged as outliers against at least this sigma, normalised: whoever weighs marks by a tenth of a pixel
  /// must not throw away what a camera's calibration leaves.
  double gateSigma() const { return gate_sigma_; }

 private:
  double focal_, least_, most_, matched_, between_tracks_, gate_sigma_;  // but for focal_ normalised
};

}  // namespace vip_slam
