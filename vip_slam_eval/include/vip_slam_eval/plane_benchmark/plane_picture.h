// SPDX-License-Identifier: BSD-3-Clause
// Estimated planes drawn over a camera image, with their outlines, ids and kinds.
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

struct PlanePictureOptions {
  double tolerance = 0.05;  ///< metres; a pixel is on the plane when its depth is within this plus 2 % of the depth
  double opacity = 0.45;
};

/// `gray` 8UC1 with planes in translucent colours (one per plane, horizontal ones grey), outlines of their area and
/// their ids. With `depth` (32FC1 metres, may be empty) only pixels whose depth lies on the plane are painted, so that
/// objects in front of a plane or behind it stay unpainted. Returns 8UC3.
cv::Mat drawPlanes(const cv::Mat& gray, const cv::Mat& depth, const CameraModel& camera, const SE3& T_map_C,
                   const std::vector<PlaneEstimate>& planes, const PlanePictureOptions& options = {});

}  // namespace vip_slam
