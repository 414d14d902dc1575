// SPDX-License-Identifier: BSD-3-Clause
// Depth from a calibrated stereo pair: rectification, OpenCV's semi-global block matching, sub-pixel refinement,
// depth = f B / disparity.
// The depth belongs to the rectified left camera, whose optical frame is the left one rotated by the rectification.
#pragma once

#include <memory>

#include <opencv2/core.hpp>

#include "vip_slam_bringup/stereo/stereo_calibration.h"
#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct StereoDepthOptions {
  int num_disparities = 96;
  int block_size = 5;
  int uniqueness = 10;
  int speckle_size = 100;
  int left_right_difference = 1;
  int refinement_window = 9;
  double min_depth = 0.3;
  double max_depth = 12.0;

  void visit(OptionVisitor& v) {
    v.field("num_disparities", num_disparities, 16, 512, "disparities searched, px; rounded up to a multiple of 16");
    v.field("block_size", block_size, 3, 21, "side of the matching block, px; odd");
    v.field("uniqueness", uniqueness, 0, 50, "margin by which the best match must win, percent");
    v.field("speckle_size", speckle_size, 0, 2000, "smaller islands of disparity are removed, px");
    v.field("left_right_difference", left_right_difference, -1, 10, "left-right check, px; -1 switches it off");
    v.field("refinement_window", refinement_window, 1, 31, "window of the sub-pixel refinement, px; 1: none");
    v.field("min_depth", min_depth, 0.05, 10.0, "nearer depths are dropped, m");
    v.field("max_depth", max_depth, 0.5, 100.0, "farther depths are dropped, m");
  }
};

struct StereoDepthFrame {
  cv::Mat gray;   ///< rectified left image, CV_8UC1
  cv::Mat depth;  ///< CV_32FC1 metres, 0 = none
};

class StereoDepth {
 public:
  /// Throws std::invalid_argument on an unusable calibration (unequal sizes, no baseline, right camera on the left).
  StereoDepth(const StereoCalibration& calibration, const StereoDepthOptions& options);
  ~StereoDepth();

  /// 8UC1 images of the calibrated size; throws std::invalid_argument naming what was given and what was expected.
  StereoDepthFrame compute(const cv::Mat& left, const cv::Mat& right) const;

  const CameraIntrinsics& rectified() const { return rectified_; }  ///< no distortion
  double baseline() const { return baseline_; }                     ///< metres
  /// Rectified left optical frame into the left optical frame (a pure rotation).
  const SE3& T_left_rectified() const { return T_left_rectified_; }
  const SE3& T_imu_rectified() const { return T_imu_rectified_; }

 private:
  struct Maps;
  std::unique_ptr<Maps> maps_;
  StereoDepthOptions options_;
  CameraIntrinsics rectified_;
  cv::Size size_;
  double baseline_ = 0;
  SE3 T_left_rectified_, T_imu_rectified_;
};

}  // namespace vip_slam
