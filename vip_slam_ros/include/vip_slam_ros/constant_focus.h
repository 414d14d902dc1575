// SPDX-License-Identifier: BSD-3-Clause
// Images of a camera whose camera_info changes from image to image (autofocus, zoom) are brought to the camera that the
// estimator was started with: nothing behind has to know. ROS-free, single owner; used by the nodelet and the offline
// runner.
#pragma once

#include <deque>
#include <string>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_ros/image_pairer.h"

namespace vip_slam {

class ConstantFocus {
 public:
  /// The camera of a camera_info stamped t (s). Of another size, or unusable: not followed.
  void add(double t, const CameraIntrinsics& camera);

  /// What the estimator works with: pairs are brought to it.
  void start(const CameraIntrinsics& camera) { constant_ = camera; }

  /// Warps the images of the pair, each by the camera that holds at its stamp. Depth too when it is `registered` to
  /// colour, else it has a camera of its own. Distortion is taken for constant.
  void apply(bool registered, ImagePair* pair);

  /// Images that were warped.
  std::size_t warped() const { return warped_; }
  /// What changed and what was done, in words; empty when nothing did.
  std::string words() const;

 private:
  struct Stamped {
    double t;
    CameraIntrinsics camera;
  };
  /// The camera at t; null: it is the constant one.
  const CameraIntrinsics* at(double t) const;

  CameraIntrinsics constant_;
  std::deque<Stamped> changes_;     ///< each holds until the next
  double least_ = 0, largest_ = 0;  ///< focal lengths fx, px
  std::size_t warped_ = 0;
};

}  // namespace vip_slam
