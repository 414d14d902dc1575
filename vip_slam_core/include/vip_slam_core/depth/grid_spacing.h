// SPDX-License-Identifier: BSD-3-Clause
// Spacing of depth look-ups on the image.
#pragma once

#include <algorithm>
#include <cmath>

namespace vip_slam {

/// Length of the longer image side, px, that options on image distances refer to.
constexpr double kReferenceSide = 640.0;

/// Scales the spacing of nodes with a smaller image, so that a surface has as many of them: 16 px of an image of
/// 320 x 240 can span a whole door in a corridor. Larger images keep the spacing.
inline double spacingOn(int width, int height, double spacing) {
  return spacing * std::min(1.0, std::max(width, height) / kReferenceSide);
}

/// The same in whole pixels, at least one.
inline int strideOn(int width, int height, int stride) {
  return std::max(1, static_cast<int>(std::lround(spacingOn(width, height, stride))));
}

}  // namespace vip_slam
