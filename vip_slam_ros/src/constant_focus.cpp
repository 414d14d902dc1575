// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/constant_focus.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/camera/constant_camera.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kStampOfInfo = 5e-4;      // s, between an image and its camera_info
constexpr double kNoChange = 1e-4;         // share of the focal length and of the width that is no change
constexpr std::size_t kChangesKept = 600;  // changes: twenty seconds of images

bool focusDiffers(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  const double f = kNoChange * b.fx, c = kNoChange * b.width;
  return std::abs(a.fx - b.fx) > f || std::abs(a.fy - b.fy) > f || std::abs(a.cx - b.cx) > c ||
         std::abs(a.cy - b.cy) > c;
}

}  // namespace

void ConstantFocus::add(double t, const CameraIntrinsics& camera) {
  if (!std::isfinite(t) || !camera.validate().empty()) return;
  if (!changes_.empty() && (t < changes_.back().t || !focusDiffers(camera, changes_.back().camera))) {
    if (t < changes_.back().t - 1)
      changes_.clear();  // the clock was set back
    else
      return;
  }
  changes_.push_back({t, camera});
  if (changes_.size() > kChangesKept) changes_.pop_front();
  least_ = least_ > 0 ? std::min(least_, camera.fx) : camera.fx;
  largest_ = std::max(largest_, camera.fx);
}

const CameraIntrinsics* ConstantFocus::at(double t) const {
  const auto next = std::upper_bound(changes_.begin(), changes_.end(), t + kStampOfInfo,
                                     [](double stamp, const Stamped& change) { return stamp < change.t; });
  if (next == changes_.begin()) return nullptr;
  const CameraIntrinsics& camera = std::prev(next)->camera;
  const bool same_size = camera.width == constant_.width && camera.height == constant_.height;
  return same_size && focusDiffers(camera, constant_) ? &camera : nullptr;
}

void ConstantFocus::apply(bool registered, ImagePair* pair) {
  const cv::Size size(constant_.width, constant_.height);
  const auto pinhole = [](CameraIntrinsics camera) {
    // The warp is one of pixels: distortion, which is the same in both, lies behind it.
    camera.model = DistortionModel::kNone;
    camera.distortion.clear();
    return camera;
  };
  const double stamp = 1e-9 * double(pair->stamp);
  const CameraIntrinsics* camera = at(stamp);
  if (camera && pair->gray.size() == size) {
    pair->gray = warpColor(pair->gray, pinhole(*camera), pinhole(constant_));
    ++warped_;
  }
  const CameraIntrinsics* then = registered ? at(stamp + pair->depth_lag) : nullptr;
  if (then && pair->depth.size() == size) pair->depth = warpDepth(pair->depth, pinhole(*then), pinhole(constant_));
}

std::string ConstantFocus::words() const {
  if (warped_ == 0) return "";
  return formatted(
      "the camera's focal length changes from image to image, between %.2f and %.2f px by camera_info: images and "
      "depth "
      "are brought to %.2f px",
      least_, largest_, constant_.fx);
}

}  // namespace vip_slam
