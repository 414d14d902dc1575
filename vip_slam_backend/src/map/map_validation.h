// SPDX-License-Identifier: BSD-3-Clause
// What numbers the map accepts; shared by its operations and its checker.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

bool isFinite(const NavState& state);
bool isFinite(const Preintegration& factor);
/// Size and outline, not the parameters.
bool isAreaFinite(const PlaneEstimate& plane);
/// Finite, and so small that a corrected rate is invertible.
bool isGyroCorrection(const Eigen::Matrix3d& correction);
bool isImuNoiseScale(const ImuNoiseScale& scale);
/// Empty when the samples are finite, in order and within the limits of map_limits.h, else the reason.
std::string validateImu(const std::vector<ImuSample>& imu);
/// Whether samples (not empty) last as long as the images' stamps, with their delays, say.
bool agreeInDuration(const std::vector<ImuSample>& imu, const TrackedFrame& from, const TrackedFrame& to);
/// Whether samples begin where those `before` end, so that both can be joined.
bool continues(const std::vector<ImuSample>& imu, const std::vector<ImuSample>& before);

}  // namespace vip_slam
