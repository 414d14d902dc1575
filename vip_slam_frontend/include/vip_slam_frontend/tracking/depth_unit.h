// SPDX-License-Identifier: BSD-3-Clause
// Detects that the unit of depth changes between two images, as when a driver's depth units are set anew at run time.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/geometry/se3.h"

namespace vip_slam::frontend {

/// The unit has changed where readings are another multiple of the predicted distances, near and far, while the colour
/// image, which knows no unit, is the same. A smaller change than the prior of the depth's scale has is left to the
/// filter. No motion is as large: an IMU whose vertical is upside down predicts one that is wrong by twice gravity.
class DepthUnit {
 public:
  DepthUnit(std::shared_ptr<const CameraModel> camera, const DepthNoise& noise);

  /// Times which readings have the unit of the first ones.
  double factor() const { return factor_; }

  /// Whether the unit changes with this image (32FC1, m, 0 = invalid, times factor()), taken at t (s) from about
  /// T_odom_C; factor() is another one then. `gray`: the colour image (8UC1, of the same size), or empty. A view that
  /// does not show it, as a bare wall, is passed over, and the next one is compared.
  bool changes(const cv::Mat& depth, const cv::Mat& gray, const SE3& T_odom_C, double t);

  /// The next image is compared with this one, in the unit of the first ones and with its estimated pose. `gray` is
  /// kept and must stay as it is.
  void remember(const cv::Mat& depth, const cv::Mat& gray, const SE3& T_odom_C, double t);

  /// A new epoch: poses have another frame. The unit stays.
  void forget() { points_.clear(); }

 private:
  struct Seen {
    Eigen::Vector3d point;  ///< odom, m
    cv::Point pixel;
  };

  std::shared_ptr<const CameraModel> camera_;
  DepthNoise noise_;
  std::vector<std::pair<cv::Point, Eigen::Vector3d>> rays_;  ///< pixels that are looked at, with z = 1
  double factor_ = 1;
  int step_;                  ///< px from one of them to the next
  std::vector<Seen> points_;  ///< of the last image
  cv::Mat gray_;              ///< that image, or empty
  double t_ = 0;              ///< its time, s
  bool open_ = false;         ///< readings may have changed since: that image stays the one to compare with
};

}  // namespace vip_slam::frontend
