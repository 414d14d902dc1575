// SPDX-License-Identifier: BSD-3-Clause
// Faults of streams in words, the same in the live system and offline.
#pragma once

#include <cstddef>
#include <string>

#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_ros/stream_time/stream_time.h"

namespace vip_slam {

/// Why an odometry starts anew: time ran back by `seconds`.
std::string timeRanBack(double seconds);
/// `topic`: of the stream, where it is one alone.
std::string clockWasSet(const ClockStep& step, const std::string& topic);
/// To follow the topic.
std::string stampedAhead(std::size_t messages);
/// To follow "images" or a number of them.
std::string holdNoDepth(const DepthNoise& noise);

}  // namespace vip_slam
