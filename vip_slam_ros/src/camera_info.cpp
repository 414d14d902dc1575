#include "vip_slam_ros/camera_info.h"

#include <algorithm>
#include <stdexcept>

namespace vip_slam {

namespace {

// width, height, K and P refer to the whole sensor; images may be cropped (region of interest) and binned.
CameraIntrinsics ofTheImages(CameraIntrinsics whole, const sensor_msgs::CameraInfo& info) {
  const sensor_msgs::RegionOfInterest& roi = info.roi;
  if (roi.width > 0 && roi.height > 0) {
    whole.cx -= roi.x_offset;
    whole.cy -= roi.y_offset;
    whole.width = int(roi.width);
    whole.height = int(roi.height);
  }
  const int columns = std::max(1, int(info.binning_x)), rows = std::max(1, int(info.binning_y));
  return columns * rows > 1 ? whole.scaled(whole.width / columns, whole.height / rows) : whole;
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
