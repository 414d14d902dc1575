// SPDX-License-Identifier: BSD-3-Clause
// Depth that is registered to the colour image with an error of some pixels. On a wall seen at a slant a neighbouring
// pixel has another depth, so that depth and colour show inconsistent motions.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace vip_slam {

struct DepthGrid;

/// Shift of the depth image to the right and down against the colour image: the reading at a pixel is the depth of
/// pixel - px.
struct DepthShift {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  Eigen::Vector2d bearing = Eigen::Vector2d::Zero();  ///< the same in normalised coordinates

  bool operator==(const DepthShift& other) const { return px == other.px && bearing == other.bearing; }
  bool operator!=(const DepthShift& other) const { return !(*this == other); }
};

/// 32FC1, metres: at each pixel the reading of `depth` at pixel + `px`; 0 beyond its border. Interpolated between
/// pixels on one surface; at edges the nearest reading.
cv::Mat shiftedDepth(const cv::Mat& depth, const Eigen::Vector2d& px);

/// Applies the shift to a grid that was read without it, using the slope between neighbouring nodes; nodes next to
/// edges and holes stay.
DepthGrid shiftedDepthGrid(const DepthGrid& grid, const Eigen::Vector2d& px);

/// Applies the shift to a depth `z` that was read at `pixel`, using the slope of the grid around it; returns `z` next
/// to edges and holes.
float shiftedDepthAt(const DepthGrid& grid, const Eigen::Vector2d& pixel, float z, const Eigen::Vector2d& px);

}  // namespace vip_slam
