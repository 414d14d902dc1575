// Depth that is registered to the colour image some pixels wrong. On a wall that is seen at a slant a pixel beside is
// another depth, so that depth and colour tell of two motions.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace vip_slam {

struct DepthGrid;

/// How far right and down of the colour image the depth image lies: what is read at a pixel is the depth of pixel - px.
struct DepthShift {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  Eigen::Vector2d bearing = Eigen::Vector2d::Zero();  ///< the same in normalised coordinates

  bool operator==(const DepthShift& other) const { return px == other.px && bearing == other.bearing; }
  bool operator!=(const DepthShift& other) const { return !(*this == other); }
};

/// 32FC1, metres: at each pixel what `depth` reads at pixel + `px`; 0 beyond its border. Between pixels that lie on one
/// surface it is interpolated, at edges the nearest reading is taken.
cv::Mat shiftedDepth(const cv::Mat& depth, const Eigen::Vector2d& px);

/// What a grid that was read without the shift would have with it, as far as neighbouring nodes tell of the slope
/// between them; nodes beside edges and holes stay.
DepthGrid shiftedDepthGrid(const DepthGrid& grid, const Eigen::Vector2d& px);

/// What a depth `z` that was read at `pixel` is with the shift, by the slope of the grid around it; `z` beside edges
/// and holes.
float shiftedDepthAt(const DepthGrid& grid, const Eigen::Vector2d& pixel, float z, const Eigen::Vector2d& px);

}  // namespace vip_slam
