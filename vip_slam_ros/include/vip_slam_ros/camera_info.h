// Camera calibration as ROS states it <-> the core's intrinsics.
#pragma once

#include <string>

#include <sensor_msgs/CameraInfo.h>

#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

/// Takes plumb_bob, rational_polynomial, equidistant, fisheye and none; an uncalibrated K (fx = 0), a missing size or
/// an unknown distortion model throws std::invalid_argument naming the field. `image_topic` is that of the images
/// meant: camera_info describes the lens, so where image_proc has rectified them already (a name with image_rect) P
/// holds, and no distortion is left. A region of interest and binning are applied: the result is of the images.
CameraIntrinsics intrinsicsFromCameraInfo(const sensor_msgs::CameraInfo& info, const std::string& image_topic = "");
sensor_msgs::CameraInfo toCameraInfo(const CameraIntrinsics& intrinsics);

}  // namespace vip_slam
