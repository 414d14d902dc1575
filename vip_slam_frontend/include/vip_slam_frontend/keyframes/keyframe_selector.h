// SPDX-License-Identifier: BSD-3-Clause
// Which images become keyframes: by rotation-compensated parallax, tracked ratio, rotation, translation over scene
// depth, and time; none while standing still.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/types/feature.h"
#include "vip_slam_frontend/keyframes/keyframe_options.h"

namespace vip_slam {

class KeyframeSelector {
 public:
  explicit KeyframeSelector(const KeyframeOptions& options) : options_(options) {}

  /// Why this image should be a keyframe; empty: it should not. T_odom_C is its camera pose.
  std::string decide(double t, const SE3& T_odom_C, const std::vector<Feature>& features, double focal_px,
                     bool still) const;
  /// The image became a keyframe.
  void accept(double t, const SE3& T_odom_C, const std::vector<Feature>& features);
  void reset();

 private:
  KeyframeOptions options_;
  bool any_ = false;
  double t_ = 0;
  SE3 T_odom_C_;
  double median_depth_ = 0;
  std::map<LandmarkId, Eigen::Vector2f> features_;
};

}  // namespace vip_slam
