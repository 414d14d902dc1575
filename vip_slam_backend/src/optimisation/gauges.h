// SPDX-License-Identifier: BSD-3-Clause
// Priors for what the measurements of a problem leave free.
#pragma once

#include "vip_slam_backend/solver/ba_problem.h"

namespace vip_slam {

/// Holds position and yaw of every connected part without a fixed frame at its oldest frame; in parts without IMU also
/// roll and pitch. Frames are connected by points, IMU, odometry and homographies, and where they see the same planes
/// if the normals of these span all directions: planes in fewer directions leave some motion free, so that each part
/// keeps a prior of its own.
void addGauges(BaProblem* problem);

/// Velocity and biases need a prior where there is no IMU factor from the frame before.
void addMotionPriors(BaProblem* problem);

}  // namespace vip_slam
