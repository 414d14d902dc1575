// SPDX-License-Identifier: BSD-3-Clause
// Rotation between successive images, for the check of delay and extrinsics: from corners tracked by KLT, with depth by
// PnP (accounts for parallax), else by aligning the bearing vectors.
#pragma once

#include <optional>

#include <opencv2/core.hpp>

#include "vip_slam_bringup/preflight/recording.h"
#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

/// Corners followed from image to image.
class ImageRotation {
 public:
  /// Corners are used where `mask` is not zero; empty: anywhere.
  explicit ImageRotation(const cv::Mat& mask = cv::Mat()) : mask_(mask) {}
  /// `image` 8UC1. Returns a step when the last two images are less than 0.2 s apart and there are enough corners.
  std::optional<PixelStep> add(double t, const cv::Mat& image);
  /// Of the image that was added last: 32FC1 metres of the same size or empty. Not written to afterwards.
  void setDepth(const cv::Mat& depth) { depth_ = depth; }

 private:
  double t_ = 0;
  cv::Mat gray_, depth_;
  cv::Mat mask_;
};

/// The step as the camera sees it; empty when too few corners agree on the motion.
std::optional<RotationStep> seenBy(const CameraModel& camera, const PixelStep& step);

}  // namespace vip_slam
