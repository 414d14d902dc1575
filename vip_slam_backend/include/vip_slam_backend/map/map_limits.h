// SPDX-License-Identifier: BSD-3-Clause
// Limits on the data of a map, from a front end or a file: what is accepted can be saved and loaded again.
#pragma once

#include <cstdint>

namespace vip_slam::map_limits {

// Far beyond any sensor; larger numbers would overflow when integrated.
constexpr double kMaxRate = 1e3;            ///< rad/s
constexpr double kMaxAcceleration = 1e4;    ///< m/s^2
constexpr double kMaxNoiseScale = 1e4;      ///< of the IMU
constexpr double kMaxWalkScale = 1e10;      ///< of its biases: configured walks begin at 1e-9
constexpr double kLongestImu = 1e4;         ///< s, of one keyframe
constexpr double kLongestImuStep = 0.2;     ///< s, between samples; over a longer one the motion is unknown
constexpr double kMaxGyroCorrection = 0.5;  ///< each entry
constexpr double kSameTime = 1e-6;          ///< s
/// s, between the duration of a keyframe's IMU samples and that of the stamps, whose delay may be estimated anew.
constexpr double kImuDuration = 0.05;
/// Largest difference of keyframe ids in a map, since tables are indexed by them: three months of keyframes.
constexpr std::uint64_t kWidestIds = std::uint64_t{1} << 24;
constexpr double kUnitNormal = 1e-7;  ///< tolerance of the length of a plane's normal

}  // namespace vip_slam::map_limits
