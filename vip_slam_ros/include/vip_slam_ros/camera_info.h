// SPDX-License-Identifier: BSD-3-Clause
// sensor_msgs/CameraInfo <-> the core's intrinsics.
#pragma once

#include <string>

#include <sensor_msgs/CameraInfo.h>

#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

/// Accepts plumb_bob, rational_polynomial, equidistant, fisheye and none; an uncalibrated camera (fx = 0 in K and P), a
/// missing size or an unknown distortion model throws std::invalid_argument naming the field. `image_topic`: topic of
/// the images. K and D describe the lens, so for images that image_proc has already rectified (a name with image_rect)
/// P is used without distortion, and where K is zero and P is not, P is used with D. A region of interest and binning
/// are applied, unless the principal point shows that K has them applied already: the result holds for the images as
/// published.
CameraIntrinsics intrinsicsFromCameraInfo(const sensor_msgs::CameraInfo& info, const std::string& image_topic = "");
/// What is unusual in how the message was read, in words; else empty.
std::string cameraInfoNote(const sensor_msgs::CameraInfo& info);
sensor_msgs::CameraInfo toCameraInfo(const CameraIntrinsics& intrinsics);

}  // namespace vip_slam
