// SPDX-License-Identifier: BSD-3-Clause
#include "pixel_noise.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

PixelNoise::PixelNoise(const MeasurementOptions& options, double focal)
    : focal_(focal),
      least_(options.pixel_sigma / focal),
      most_(std::max(options.max_pixel_sigma, options.pixel_sigma) / focal),
      matched_(options.matched_pixel_sigma / focal),
      between_tracks_(options.between_tracks_sigma / focal),
      gate_sigma_(options.gate_sigma / focal) {}

double PixelNoise::sigma(const Feature& feature, bool own_track, double apart) const {
  if (feature.id == kNoLandmark) return matched_ * std::pow(kOctaveScale, feature.octave);  // matched by its descriptor
  const double tracked = std::clamp(feature.pixel_sigma / focal_, least_, most_);
  return own_track ? tracked : std::hypot(tracked, apart * between_tracks_);
}

}  // namespace vip_slam
