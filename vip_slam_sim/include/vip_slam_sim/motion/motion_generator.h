// SPDX-License-Identifier: BSD-3-Clause
// Turns MotionOptions into a spline of the body (IMU).
#pragma once

#include "vip_slam_sim/motion/spline_trajectory.h"
#include "vip_slam_sim/sequence/sequence_spec.h"

namespace vip_slam {

/// Begins at time 0. Throws std::invalid_argument or std::runtime_error naming the key or file.
SplineTrajectory makeMotion(const MotionOptions& options, const SE3& T_imu_cam, int seed);

/// Poses from a TUM file or an EuRoC state CSV (distinguished by the first data line). Times start at 0.
Trajectory readPoseFile(const std::string& path);

}  // namespace vip_slam
