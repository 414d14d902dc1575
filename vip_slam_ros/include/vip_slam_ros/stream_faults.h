// Faults of streams in words, the same in the live system and offline.
#pragma once

#include <string>

#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// Why an odometry starts anew: a clock that ran back by `seconds`.
std::string timeRanBack(double seconds);
/// `t`: stamp after the step, seconds.
std::string clockSetBack(double seconds, double t);
/// To follow "images" or a number of them.
std::string holdNoDepth(const DepthNoise& noise);

}  // namespace vip_slam
