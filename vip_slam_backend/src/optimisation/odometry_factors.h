// What the odometry says about the motion between successive keyframes. It saw every image and every depth image in
// between, the back end sees the keyframes only: where few landmarks live from one keyframe to the next that is most of
// what is known. It also keeps landmarks that move together from taking the map along. Not in the paper.
#pragma once

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_backend/map/map_types.h"
#include "vip_slam_backend/solver/ba_problem.h"

namespace vip_slam {

/// The factor of `keyframe`'s motion since its previous one, i and j being their frames. False: nothing is known of it.
bool odometryFactor(const MapKeyframe& keyframe, int i, int j, const MeasurementOptions& options,
                    BaRelativePose* factor);

}  // namespace vip_slam
