// SPDX-License-Identifier: BSD-3-Clause
// A mip-mapped texture with anisotropic look-up, which avoids aliasing at long range and grazing angles.
// Colours are stored as the square root of the reflectance (gamma 2): filtering happens in that space.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_sim/scene/vec.h"

namespace vip_slam {

class Texture {
 public:
  /// `image`: CV_8UC3 RGB or CV_32FC3 RGB in 0..1, row 0 at the top. A repeating texture needs power-of-two sides.
  /// Throws std::invalid_argument otherwise.
  Texture(const cv::Mat& image, bool repeat);

  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }

  /// Filtered colour at texel coordinates (s right, t down), with the change of (s, t) per pixel step in x and y.
  Vec4 sample(float s, float t, float dsdx, float dtdx, float dsdy, float dtdy) const;

 private:
  struct Level {
    int width, height;
    float scale_s, scale_t;  ///< of finest-level texel coordinates
    std::size_t offset;
  };
  template <bool kRepeat>
  Vec4 bilinear(const Level& level, float s, float t) const;
  template <bool kRepeat>
  Vec4 probe(const Level& a, const Level& b, float f, float s, float t, float ds, float dt, int probes) const;
  void addLevel(const cv::Mat& image);

  bool repeat_;
  std::vector<Level> levels_;
  std::vector<std::uint16_t> texels_;  ///< RGBA
};

}  // namespace vip_slam
