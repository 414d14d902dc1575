// SPDX-License-Identifier: BSD-3-Clause
// Factors from the odometry's motion between successive keyframes. The odometry used every image and depth image in
// between, the back end only keyframes: where few landmarks survive from one keyframe to the next this is most of the
// information. It also keeps landmarks that move together from distorting the map. Not in the paper.
#pragma once

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_backend/map/map_types.h"
#include "vip_slam_backend/solver/ba_problem.h"

namespace vip_slam {

/// The covariance of a motion of the odometry with what neither odometry nor map know better, even of the shortest one.
Matrix6d leastCovariance(const Matrix6d& covariance);

/// The factor of `keyframe`'s motion since its previous one; i and j are their frames. False: the motion is not known.
bool odometryFactor(const MapKeyframe& keyframe, int i, int j, const MeasurementOptions& options,
                    BaRelativePose* factor);

}  // namespace vip_slam
