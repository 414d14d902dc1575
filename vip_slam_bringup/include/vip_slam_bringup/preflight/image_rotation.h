// Rotation between successive images, for the check of delay and extrinsics: from corners tracked by KLT, with depth by
// PnP (accounts for parallax), else by aligning the bearing vectors.
#pragma once

#include <memory>
#include <optional>

#include <opencv2/core.hpp>

#include "vip_slam_bringup/preflight/recording.h"
#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

class ImageRotation {
 public:
  /// Corners are used where `mask` is not zero; empty: anywhere.
  explicit ImageRotation(std::shared_ptr<const CameraModel> camera, const cv::Mat& mask = cv::Mat())
      : camera_(std::move(camera)), mask_(mask) {}
  /// `gray` 8UC1 of the camera's size, `depth` 32FC1 metres of the same size or empty. Returns a step when the last two
  /// images are less than 0.2 s apart and enough corners agree on the motion.
  std::optional<RotationStep> add(double t, const cv::Mat& gray, const cv::Mat& depth);

 private:
  /// R_now_before, and the corners with depth.
  std::optional<Eigen::Matrix3d> rotationTo(const cv::Mat& gray, std::vector<CornerTrack>* tracks) const;

  std::shared_ptr<const CameraModel> camera_;
  double t_ = 0;
  cv::Mat gray_, depth_;
  cv::Mat mask_;
};

}  // namespace vip_slam
