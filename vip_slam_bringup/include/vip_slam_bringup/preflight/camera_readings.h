// SPDX-License-Identifier: BSD-3-Clause
// Other readings of a calibration that drivers are known to mean by it: the same numbers under another model, for
// images that are rectified already, with roi and binning applied already; and camera_info's in place of a sensor
// file's.
#pragma once

#include <vector>

#include <sensor_msgs/CameraInfo.h>

#include "vip_slam_bringup/preflight/recording.h"

namespace vip_slam {

/// The largest distance of the pixels at which two cameras of one image size see a direction; infinite where one of
/// them does not see it, or folds the image over.
double pixelsApart(const CameraIntrinsics& a, const CameraIntrinsics& b);
/// Readings whose pixels differ from those of `used` by two or more somewhere in the image.
std::vector<CameraReading> otherReadings(const CameraIntrinsics& used);
/// `used` is of a sensor file, `of_info` what camera_info says.
std::vector<CameraReading> otherReadings(const CameraIntrinsics& used, const CameraIntrinsics& of_info);
/// `info`: the message that `used` is of.
std::vector<CameraReading> otherReadings(const CameraIntrinsics& used, const sensor_msgs::CameraInfo& info);

}  // namespace vip_slam
