// SPDX-License-Identifier: BSD-3-Clause
// How stable the horizontal planes of a map are: their height as measured by each depth image at its estimated pose.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

struct PlaneHeight {
  double t = 0;       ///< seconds
  double height = 0;  ///< metres, z in the planes' world: median over the depth points on the plane
  std::size_t points = 0;
};
using PlaneHeights = std::map<PlaneId, std::vector<PlaneHeight>>;  ///< per horizontal plane, in order of time

/// Adds the height measured by one depth image (32FC1 metres, of `camera`) for every horizontal plane seen from its
/// front side, from the depth points, every fourth row and column, inside the outline and within 10 cm of the plane.
/// Planes with fewer than `min_points` of them are skipped.
void measureHeights(double t, const cv::Mat& depth, const CameraModel& camera, const SE3& T_map_C,
                    const std::vector<PlaneEstimate>& planes, PlaneHeights* heights, std::size_t min_points = 200);

/// One line per plane: id, area, images, mean height, standard deviation and range, in centimetres.
std::string heightTable(const PlaneHeights& heights, const std::vector<PlaneEstimate>& planes);
/// CSV plane,t,height_m,points.
std::string heightsCsv(const PlaneHeights& heights);

}  // namespace vip_slam
