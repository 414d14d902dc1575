// SPDX-License-Identifier: BSD-3-Clause
// Sigma of a feature's pixel. The front end reports it for each track (its tracking/pixel_noise.h): a tenth of a pixel
// where the depth gives the patch's surface, several times that elsewhere. This is the scatter of a track's views about
// the point that its reference patch shows; the patch of another track of the same landmark shows a point next to it.
#pragma once

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_core/types/feature.h"

namespace vip_slam {

class PixelNoise {
 public:
  PixelNoise(const MeasurementOptions& options, double focal);

  /// One sigma of a view of a point, in normalised coordinates. `own_track`: the view is of the point's track. Else
  /// `apart` is the distance of the two tracks' corners in this view, as a factor on between_tracks_sigma: half a pixel
  /// at detection from afar is more pixels when seen from near by.
  double sigma(const Feature& feature, bool own_track, double apart) const;
  /// Smallest sigma, normalised, with which outliers are judged: with sigmas of a tenth of a pixel the residual errors
  /// of a camera's calibration would count as outliers.
  double gateSigma() const { return gate_sigma_; }

 private:
  double focal_, least_, most_, matched_, between_tracks_, gate_sigma_;  // normalised, except focal_ in px
};

}  // namespace vip_slam
