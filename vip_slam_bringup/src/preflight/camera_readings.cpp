// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/preflight/camera_readings.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <stdexcept>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_ros/camera_info.h"

namespace vip_slam {
namespace {

/// Whether the two are of one image size and see a direction at places that differ by two pixels or more.
bool differ(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  return a.width == b.width && a.height == b.height && pixelsApart(a, b) > 2;
}

void add(const CameraIntrinsics& used, const CameraIntrinsics& other, const std::string& what,
         std::vector<CameraReading>* out) {
  try {
    makeCamera(other);
  } catch (const std::invalid_argument&) {  // folds the image over: no camera is like that
    return;
  }
  if (!differ(used, other)) return;
  for (const CameraReading& reading : *out)
    if (!differ(reading.camera, other)) return;
  out->push_back({other, what});
}

}  // namespace

double pixelsApart(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  double most = 0;
  std::shared_ptr<const CameraModel> from, to;
  try {
    from = makeCamera(a), to = makeCamera(b);
  } catch (const std::invalid_argument&) {  // folds the image over
    return std::numeric_limits<double>::infinity();
  }
  for (int i = 0; i <= 8; ++i) {
    for (int j = 0; j <= 8; ++j) {
      const Eigen::Vector2d uv(a.width * i / 8.0 - 0.5, a.height * j / 8.0 - 0.5);
      Eigen::Vector2d xy, seen;
      if (!from->undistort(uv, &xy)) continue;
      if (!to->project(xy.homogeneous(), &seen)) return std::numeric_limits<double>::infinity();
      most = std::max(most, (seen - uv).norm());
    }
  }
  return most;
}

std::vector<CameraReading> otherReadings(const CameraIntrinsics& used) {
  std::vector<CameraReading> out;
  if (used.model == DistortionModel::kNone) return out;
  CameraIntrinsics other = used;
  other.model = DistortionModel::kNone;
  other.distortion.clear();
  add(used, other, "the images are rectified already, its coefficients are not to be applied", &out);
  other = used;
  const bool equidistant = used.model == DistortionModel::kEquidistant;
  other.model = equidistant ? DistortionModel::kRadTan : DistortionModel::kEquidistant;
  other.distortion.resize(4);
  if (equidistant || used.distortion.size() <= 5)
    add(used, other, "its coefficients are those of the model " + distortionModelName(other.model), &out);
  return out;
}

std::vector<CameraReading> otherReadings(const CameraIntrinsics& used, const CameraIntrinsics& of_info) {
  std::vector<CameraReading> out;
  add(used, of_info, "camera_info holds, not the camera of the sensor file", &out);
  for (const CameraReading& reading : otherReadings(used)) add(used, reading.camera, reading.what, &out);
  return out;
}

std::vector<CameraReading> otherReadings(const CameraIntrinsics& used, const sensor_msgs::CameraInfo& info) {
  std::vector<CameraReading> out = otherReadings(used);
  CameraIntrinsics other = used;
  if (info.K[0] > 0) {
    other.fx = info.K[0], other.fy = info.K[4], other.cx = info.K[2], other.cy = info.K[5];
    add(used, other, "K is that of the images already, without roi and binning", &out);
    const double columns = std::max(1, int(info.binning_x)), rows = std::max(1, int(info.binning_y));
    other.fx /= columns, other.cx = (other.cx - info.roi.x_offset + 0.5) / columns - 0.5;
    other.fy /= rows, other.cy = (other.cy - info.roi.y_offset + 0.5) / rows - 0.5;
    add(used, other, "K is that of the whole sensor, roi and binning are to be applied", &out);
  }
  if (info.P[0] > 0) {
    other.fx = info.P[0], other.fy = info.P[5], other.cx = info.P[2], other.cy = info.P[6];
    other.model = DistortionModel::kNone;
    other.distortion.clear();
    add(used, other, "the images are rectified already: P holds, not K and its coefficients", &out);
  }
  return out;
}

}  // namespace vip_slam
