// SPDX-License-Identifier: BSD-3-Clause
// Edge-safe depth: a look-up that refuses values next to depth edges, and a coarse grid of such depths.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// Depth z in metres at sub-pixel (u, v): a local plane-aware robust value (median), 0 when invalid, out of range, or
/// next to an edge. `depth` is CV_32FC1, metres; 0 and NaN are invalid.
float safeDepth(const cv::Mat& depth, double u, double v, const DepthNoise& noise);

/// Converts 16UC1 (times `scale` metres) or 32FC1 to 32FC1 metres with invalid = 0; `offset` metres are added to valid
/// readings, which become invalid when the result is not positive. Throws std::invalid_argument on other types, naming
/// the type.
cv::Mat depthToMetres(const cv::Mat& raw, double scale, double offset = 0);

/// Depths on a regular pixel grid; node (c, r) sits at pixel (offset + c*stride, offset + r*stride). 0 = invalid.
struct DepthGrid {
  int stride = 0, offset = 0, cols = 0, rows = 0;
  std::vector<float> z;  ///< metres, row-major
  bool empty() const { return z.empty(); }
  float at(int c, int r) const { return z[static_cast<std::size_t>(r) * cols + c]; }
  Eigen::Vector2d pixel(int c, int r) const { return {double(offset + c * stride), double(offset + r * stride)}; }
  /// The first of the four nodes (c, r) to (c + 1, r + 1) around a pixel; false outside the grid.
  bool nodesAround(const Eigen::Vector2d& uv, int* c, int* r) const {
    *c = static_cast<int>(std::floor((uv.x() - offset) / stride));
    *r = static_cast<int>(std::floor((uv.y() - offset) / stride));
    return *c >= 0 && *r >= 0 && *c + 1 < cols && *r + 1 < rows;
  }
};
DepthGrid makeDepthGrid(const cv::Mat& depth, int stride, const DepthNoise& noise);

/// Registers depth images of a separate depth camera to the colour camera (z-buffered forward warp). Rays and the
/// footprint of each depth pixel are computed once, so that each image of a stream only costs the warp.
class DepthRegistration {
 public:
  /// Throws std::invalid_argument when a camera is null.
  DepthRegistration(std::shared_ptr<const CameraModel> depth_camera, std::shared_ptr<const CameraModel> colour_camera,
                    const Eigen::Matrix4d& T_colour_depth);
  /// `depth` is 32FC1 metres of the depth camera's size; returns 32FC1 metres of the colour camera's size, 0 = invalid.
  cv::Mat operator()(const cv::Mat& depth) const;

 private:
  std::shared_ptr<const CameraModel> depth_camera_, colour_camera_;
  Eigen::Matrix3f R_;  ///< colour from depth
  Eigen::Vector3f t_;
  std::vector<Eigen::Vector2f> xy_;  ///< normalised coordinates of each depth pixel, row-major; NaN without a ray
  float footprint_u_ = 1, footprint_v_ = 1;  ///< colour pixels per depth pixel
};

}  // namespace vip_slam
