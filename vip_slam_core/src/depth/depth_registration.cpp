// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "vip_slam_core/depth/depth_image.h"

namespace vip_slam {

DepthRegistration::DepthRegistration(std::shared_ptr<const CameraModel> depth_camera,
                                     std::shared_ptr<const CameraModel> colour_camera,
                                     const Eigen::Matrix4d& T_colour_depth)
    : depth_camera_(std::move(depth_camera)), colour_camera_(std::move(colour_camera)) {
  if (!depth_camera_ || !colour_camera_) {
    throw std::invalid_argument("depth registration: a camera is missing, expected depth and colour cameras");
  }
  R_ = T_colour_depth.topLeftCorner<3, 3>().cast<float>();
  t_ = T_colour_depth.topRightCorner<3, 1>().cast<float>();
  footprint_u_ = float(colour_camera_->intrinsics().fx / depth_camera_->intrinsics().fx);
  footprint_v_ = float(colour_camera_->intrinsics().fy / depth_camera_->intrinsics().fy);
  xy_.reserve(static_cast<std::size_t>(depth_camera_->width()) * depth_camera_->height());
  for (int v = 0; v < depth_camera_->height(); ++v) {
    for (int u = 0; u < depth_camera_->width(); ++u) {
      Eigen::Vector2d xy;
      if (!depth_camera_->undistort(Eigen::Vector2d(u, v), &xy))
        xy.setConstant(std::numeric_limits<double>::quiet_NaN());
      xy_.push_back(xy.cast<float>());
    }
  }
}

cv::Mat DepthRegistration::operator()(const cv::Mat& depth) const {
  if (depth.type() != CV_32FC1 || depth.cols != depth_camera_->width() || depth.rows != depth_camera_->height()) {
    throw std::invalid_argument("depth registration: image is " + std::to_string(depth.cols) + "x" +
                                std::to_string(depth.rows) + " " + cv::typeToString(depth.type()) + ", expected " +
                                std::to_string(depth_camera_->width()) + "x" + std::to_string(depth_camera_->height()) +
                                " CV_32FC1");
  }
  cv::Mat registered(colour_camera_->height(), colour_camera_->width(), CV_32FC1, cv::Scalar(0));
  std::size_t i = 0;
  for (int v = 0; v < depth.rows; ++v) {
    const float* row = depth.ptr<float>(v);
    for (int u = 0; u < depth.cols; ++u, ++i) {
      const float z = row[u];
      if (!(z > 0) || std::isnan(xy_[i].x())) continue;
      const Eigen::Vector3f p = R_ * Eigen::Vector3f(xy_[i].x() * z, xy_[i].y() * z, z) + t_;
      Eigen::Vector2d uv;
      if (!colour_camera_->project(p.cast<double>(), &uv)) continue;
      // The depth pixel's footprint in the colour image, at least the nearest pixel; the nearest surface wins.
      const double half_u = 0.5 * footprint_u_ * z / p.z(), half_v = 0.5 * footprint_v_ * z / p.z();
      const int nearest_u = static_cast<int>(std::floor(uv.x() + 0.5)),
                nearest_v = static_cast<int>(std::floor(uv.y() + 0.5));
      const int u0 = std::max(0, std::min(nearest_u, static_cast<int>(std::ceil(uv.x() - half_u))));
      const int u1 = std::min(registered.cols - 1, std::max(nearest_u, static_cast<int>(std::floor(uv.x() + half_u))));
      const int v0 = std::max(0, std::min(nearest_v, static_cast<int>(std::ceil(uv.y() - half_v))));
      const int v1 = std::min(registered.rows - 1, std::max(nearest_v, static_cast<int>(std::floor(uv.y() + half_v))));
      for (int y = v0; y <= v1; ++y) {
        float* out = registered.ptr<float>(y);
        for (int x = u0; x <= u1; ++x) {
          if (out[x] == 0 || p.z() < out[x]) out[x] = p.z();
        }
      }
    }
  }
  return registered;
}

}  // namespace vip_slam
