// SPDX-License-Identifier: BSD-3-Clause
// Outlier rejection when the rotation between two images is not known (IMU gap, wrong calibration): camera pose from
// points with depth. Without depth nothing replaces the rotation.
#pragma once

#include <vector>

#include "vip_slam_frontend/tracking/outlier_rejection.h"

namespace vip_slam {

struct GeneralMotion {
  bool ok = false;
  std::vector<char> inlier;
  int inliers = 0;
  SE3 T_current_previous;
};

/// Pose from samples of four points with depth, started at `predicted`; not ok with fewer than eight points with depth.
/// Pairs without depth are judged by their distance from the epipolar line.
GeneralMotion poseFromDepth(const std::vector<PointPair>& pairs, const SE3& predicted, const RansacOptions& options);

}  // namespace vip_slam
