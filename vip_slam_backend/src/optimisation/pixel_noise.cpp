#include "pixel_noise.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

PixelNoise::PixelNoise(const MeasurementOptions& options, double focal)
    : first_(options.pixel_sigma / focal),
      creep_(options.pixel_creep / focal),
      most_(std::max(options.max_pixel_sigma, options.pixel_sigma) / focal),
      matched_(options.matched_pixel_sigma / focal),
      gate_sigma_(options.gate_sigma / focal) {}

double PixelNoise::sigma(const Feature& feature, int order) const {
  if (feature.id == kNoLandmark) return matched_ * std::pow(1.2, feature.octave);  // found by its descriptor
  const double crept = creep_ * order;
  return std::min(std::sqrt(first_ * first_ + crept * crept), most_);
}

}  // namespace vip_slam
