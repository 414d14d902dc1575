// SPDX-License-Identifier: BSD-3-Clause
// Limits on the data of a map, from a front end or a file: what is accepted can be saved and loaded again.
#pragma once

#include <cstdint>

namespace vip_slam::map_limits {

/// Of rates, accelerations, durations and factors on noise, in SI units: larger numbers would overflow when integrated.
constexpr double kLargest = 1e10;
constexpr double kLongestImuStep = 0.2;  ///< s, between samples; over a longer one the motion is unknown
constexpr double kRounding = 1e-6;       ///< s between equal stamps; of the length of a unit vector
/// s, between the duration of a keyframe's IMU samples and that of the stamps, whose delay may be estimated anew.
constexpr double kImuDuration = 0.05;
/// Largest difference of keyframe ids in a map, since tables are indexed by them: three months of keyframes.
constexpr std::uint64_t kWidestIds = std::uint64_t{1} << 24;

}  // namespace vip_slam::map_limits
