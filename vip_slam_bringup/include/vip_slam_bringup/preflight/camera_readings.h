// SPDX-License-Identifier: BSD-3-Clause
// Other readings of a calibration that drivers are known to mean by it: the same numbers under another model, for
// images that are rectified already, with roi and binning applied already.
#pragma once

#include <vector>

#include <sensor_msgs/CameraInfo.h>

#include "vip_slam_bringup/preflight/recording.h"

namespace vip_slam {

/// Readings whose pixels differ from those of `used` by two or more somewhere in the image.
std::vector<CameraReading> otherReadings(const CameraIntrinsics& used);
/// `info`: the message that `used` is of.
std::vector<CameraReading> otherReadings(const CameraIntrinsics& used, const sensor_msgs::CameraInfo& info);

}  // namespace vip_slam
