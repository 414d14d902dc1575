// How far apart on the image depth is looked up.
#pragma once

#include <algorithm>
#include <cmath>

namespace vip_slam {

/// Distances between nodes are set for an image whose longer side has 640 px, and shrink with a smaller one, so that as
/// many nodes show a surface: 16 px of an image of 320 x 240 span the door of a corridor. Larger images keep them.
inline double spacingOn(int width, int height, double spacing) {
  constexpr double kGivenFor = 640.0;  // px
  return spacing * std::min(1.0, std::max(width, height) / kGivenFor);
}

/// The same in whole pixels, at least one.
inline int strideOn(int width, int height, int stride) {
  return std::max(1, static_cast<int>(std::lround(spacingOn(width, height, stride))));
}

}  // namespace vip_slam
