// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/sensor/depth_to_colour.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "vip_slam_core/util/size_text.h"

namespace vip_slam {
namespace {

Eigen::Vector2d pinholePixel(const CameraIntrinsics& k, const Eigen::Vector2d& xy) {
  return {k.fx * xy.x() + k.cx, k.fy * xy.y() + k.cy};
}

/// Depth is looked up, not interpolated: between foreground and background there is nothing.
cv::Mat sourcePixels(const CameraModel& camera) {
  const CameraIntrinsics& k = camera.intrinsics();
  cv::Mat out(k.height, k.width, CV_32SC1, cv::Scalar(-1));
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      Eigen::Vector2d xy;
      if (!camera.undistort(Eigen::Vector2d(u, v), &xy)) continue;
      const Eigen::Vector2d uv = pinholePixel(k, xy);
      const double column = std::floor(uv.x() + 0.5), row = std::floor(uv.y() + 0.5);
      if (column >= 0 && row >= 0 && column < k.width && row < k.height)
        out.at<int>(v, u) = static_cast<int>(row) * k.width + static_cast<int>(column);
    }
  }
  return out;
}

}  // namespace

DepthToColour::DepthToColour(const SensorConfig& sensor) {
  if (!sensor.depth_registered)
    registration_.emplace(makeCamera(sensor.depth_camera), makeCamera(sensor.camera), sensor.T_color_depth.matrix());
  else if (sensor.depth_undistorted && largestDistortion(sensor.camera) > 0)
    source_ = sourcePixels(*makeCamera(sensor.camera));
}

cv::Mat DepthToColour::operator()(const cv::Mat& depth) const {
  if (registration_) return (*registration_)(depth);
  if (source_.empty()) return depth;
  if (depth.type() != CV_32FC1 || depth.size() != source_.size())
    throw std::invalid_argument("undistorted depth: image is " + sizeText(depth.size()) + " " +
                                cv::typeToString(depth.type()) + ", expected " + sizeText(source_.size()) +
                                " CV_32FC1 as the colour image");
  const cv::Mat from = depth.isContinuous() ? depth : depth.clone();
  cv::Mat out(source_.size(), CV_32FC1);
  for (int v = 0; v < out.rows; ++v) {
    const int* source = source_.ptr<int>(v);
    float* to = out.ptr<float>(v);
    for (int u = 0; u < out.cols; ++u) to[u] = source[u] < 0 ? 0.0f : from.ptr<float>()[source[u]];
  }
  return out;
}

CameraIntrinsics pinholeOf(const CameraIntrinsics& camera) {
  CameraIntrinsics out = camera;
  out.model = DistortionModel::kNone;
  out.distortion.clear();
  return out;
}

double largestDistortion(const CameraIntrinsics& camera) {
  const bool plain = camera.model == DistortionModel::kNone ||
                     (camera.model == DistortionModel::kRadTan &&
                      std::all_of(camera.distortion.begin(), camera.distortion.end(), [](double d) { return d == 0; }));
  if (plain || !camera.validate().empty()) return 0;
  const auto model = makeCamera(camera);
  double largest = 0;
  const auto look = [&](double u, double v) {
    Eigen::Vector2d xy;
    if (model->undistort({u, v}, &xy))
      largest = std::max(largest, (pinholePixel(camera, xy) - Eigen::Vector2d(u, v)).norm());
  };
  for (int u = 0; u < camera.width; ++u)
    for (const int v : {0, camera.height - 1}) look(u, v);
  for (int v = 0; v < camera.height; ++v)
    for (const int u : {0, camera.width - 1}) look(u, v);
  return largest;
}

}  // namespace vip_slam
