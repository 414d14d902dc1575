// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/camera_info.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vip_slam {

namespace {

bool cropped(const sensor_msgs::CameraInfo& info) { return info.roi.width > 0 && info.roi.height > 0; }
int binning(std::uint32_t given) { return std::max(1, int(given)); }

// How far a principal point is from the middle of the sensor, as a share of the sensor's size.
double besideTheMiddle(const CameraIntrinsics& whole) {
  return std::max(std::abs((whole.cx + 0.5) / whole.width - 0.5), std::abs((whole.cy + 0.5) / whole.height - 0.5));
}

// width, height, K and P refer to the whole sensor; images may be cropped (region of interest) and binned. Some drivers
// fill roi and binning and give a K that is of the images already: on the whole sensor its principal point would then
// lie where no lens has it, and taken as that of the images it lies in the sensor's middle.
bool ofTheImagesAlready(const CameraIntrinsics& given, const sensor_msgs::CameraInfo& info) {
  constexpr double kNoLens = 0.1, kMiddle = 0.05;
  CameraIntrinsics whole = given;
  whole.cx = (given.cx + 0.5) * binning(info.binning_x) - 0.5;
  whole.cy = (given.cy + 0.5) * binning(info.binning_y) - 0.5;
  if (cropped(info)) whole.cx += info.roi.x_offset, whole.cy += info.roi.y_offset;
  return besideTheMiddle(given) > kNoLens && besideTheMiddle(whole) < kMiddle;
}

CameraIntrinsics ofTheImages(const CameraIntrinsics& given, const sensor_msgs::CameraInfo& info) {
  const sensor_msgs::RegionOfInterest& roi = info.roi;
  CameraIntrinsics images = given;
  if (cropped(info)) {
    images.cx -= roi.x_offset;
    images.cy -= roi.y_offset;
    images.width = int(roi.width);
    images.height = int(roi.height);
  }
  const int columns = binning(info.binning_x), rows = binning(info.binning_y);
  if (columns * rows > 1) images = images.scaled(images.width / columns, images.height / rows);
  if (!ofTheImagesAlready(given, info)) return images;
  images.fx = given.fx, images.fy = given.fy, images.cx = given.cx, images.cy = given.cy;
  return images;
}

// Drivers pad the coefficients of a model with zeros.
void dropTrailingZeros(std::size_t least, std::vector<double>* coefficients) {
  while (coefficients->size() > least && coefficients->back() == 0) coefficients->pop_back();
}

bool onlyProjection(const sensor_msgs::CameraInfo& info) {
  return info.K[0] == 0 && info.K[4] == 0 && info.P[0] > 0 && info.P[5] > 0;
}

}  // namespace

std::string cameraInfoNote(const sensor_msgs::CameraInfo& info) {
  CameraIntrinsics given;
  given.width = int(info.width), given.height = int(info.height);
  given.cx = info.K[2], given.cy = info.K[5];
  if (info.K[0] > 0 && given.width > 0 && given.height > 0 && ofTheImagesAlready(given, info))
    return "K is taken for that of the images already, without roi and binning: on the whole sensor its principal "
           "point would lie " +
           std::to_string(int(std::lround(100 * besideTheMiddle(given)))) + " % beside the middle";
  if (!onlyProjection(info)) return "";
  const bool straight = std::all_of(info.D.begin(), info.D.end(), [](double d) { return d == 0; });
  return std::string("K is zero, P is used instead") +
         (straight ? "" : ", though D has a distortion, and P need not be of the distorted image then");
}

CameraIntrinsics intrinsicsFromCameraInfo(const sensor_msgs::CameraInfo& info, const std::string& image_topic) {
  CameraIntrinsics intrinsics;
  intrinsics.width = int(info.width);
  intrinsics.height = int(info.height);
  // Some drivers leave K empty, some P.
  const bool rectified = image_topic.find("image_rect") != std::string::npos;
  const bool projection = (rectified && info.P[0] > 0) || onlyProjection(info);
  intrinsics.fx = projection ? info.P[0] : info.K[0];
  intrinsics.cx = projection ? info.P[2] : info.K[2];
  intrinsics.fy = projection ? info.P[5] : info.K[4];
  intrinsics.cy = projection ? info.P[6] : info.K[5];
  if (rectified) {
    const std::string wrong = intrinsics.validate();
    if (!wrong.empty()) throw std::invalid_argument("camera_info: " + wrong);
    return ofTheImages(intrinsics, info);
  }
  const bool zero = std::all_of(info.D.begin(), info.D.end(), [](double d) { return d == 0; });
  // An equidistant lens with zero coefficients is still not a pinhole.
  const bool equidistant = info.distortion_model == "equidistant" || info.distortion_model == "fisheye";
  const bool straight = zero && !(equidistant && !info.D.empty());
  try {
    // Drivers of rectified images leave the model empty, or name one with all-zero coefficients. Coefficients without a
    // model are taken as OpenCV's.
    const std::string& name = info.distortion_model;
    intrinsics.model = straight ? DistortionModel::kNone : distortionModelFromName(name.empty() ? "plumb_bob" : name);
  } catch (const std::exception& error) {
    throw std::invalid_argument(std::string("camera_info.distortion_model: ") + error.what());
  }
  if (!straight) intrinsics.distortion.assign(info.D.begin(), info.D.end());
  if (!straight && zero) intrinsics.distortion.resize(4);  // some drivers give five, as for plumb_bob
  const std::size_t most = intrinsics.model == DistortionModel::kEquidistant ? 4 : 8;
  dropTrailingZeros(most, &intrinsics.distortion);
  const std::string wrong = intrinsics.validate();
  if (!wrong.empty()) throw std::invalid_argument("camera_info: " + wrong);
  return ofTheImages(intrinsics, info);
}

sensor_msgs::CameraInfo toCameraInfo(const CameraIntrinsics& intrinsics) {
  sensor_msgs::CameraInfo info;
  info.width = std::uint32_t(intrinsics.width);
  info.height = std::uint32_t(intrinsics.height);
  switch (intrinsics.model) {
    case DistortionModel::kNone:
      info.distortion_model = "plumb_bob";
      break;
    case DistortionModel::kRadTan:
      info.distortion_model = intrinsics.distortion.size() > 5 ? "rational_polynomial" : "plumb_bob";
      break;
    case DistortionModel::kEquidistant:
      info.distortion_model = "equidistant";
      break;
  }
  info.D.assign(intrinsics.distortion.begin(), intrinsics.distortion.end());
  // Never empty: without coefficients any model is read as a pinhole.
  const std::size_t coefficients = intrinsics.model == DistortionModel::kEquidistant ? 4 : 5;
  info.D.resize(std::max(coefficients, info.D.size()), 0.0);
  info.K = {intrinsics.fx, 0, intrinsics.cx, 0, intrinsics.fy, intrinsics.cy, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {intrinsics.fx, 0, intrinsics.cx, 0, 0, intrinsics.fy, intrinsics.cy, 0, 0, 0, 1, 0};
  return info;
}

}  // namespace vip_slam
