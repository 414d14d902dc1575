// SPDX-License-Identifier: BSD-3-Clause
// Depth of the surface a tracked corner belongs to. Corners gather where surfaces end (door frames, rims of boxes),
// where a window of readings holds two surfaces, and on walls seen at a flat angle, where it holds a wide range of
// depths. The edge-safe look-up refuses both; here planes decide. A plane is affine in inverse depth:
// 1/z = a + b u + c v.
#pragma once

#include <opencv2/core.hpp>

#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

struct FeatureDepth {
  enum class Source {
    kNone,     ///< no readings around
    kUnclear,  ///< readings, but no explanation for them
    kSmooth,   ///< the edge-safe look-up gave it
    kSlanted,  ///< one plane, seen at a flat angle
    kRim       ///< the nearer of two surfaces
  };
  float z = 0;      ///< metres; 0: none
  float sigma = 0;  ///< one sigma of z, metres; on a slanted surface it includes an error of half a pixel
  Source source = Source::kNone;
};

/// At sub-pixel (u, v) of `depth` (32FC1, metres, 0 or NaN invalid). Where two surfaces meet in an edge the nearer one
/// is taken, since its outline is what the image shows; nothing when neither explanation fits the readings.
FeatureDepth featureDepth(const cv::Mat& depth, double u, double v, const DepthNoise& noise);

}  // namespace vip_slam
