// SPDX-License-Identifier: BSD-3-Clause
// Depth readings of single points share errors as those of planes do: with their neighbours on the same surface in one
// keyframe, and with the next keyframes.
#pragma once

#include <vector>

#include "vip_slam_backend/solver/ba_problem.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// Sets the weights of all depth observations, whose depth_weight is that of the reading's white part. A reading that
/// shares its error with n - 1 others of its point's surface and keyframe has the variance white^2 + n shared^2: any
/// number of them is worth one with shared^2. `times`: of the frames, s.
void shareDepthErrors(const DepthNoise& model, const DepthNoiseParts& noise, const std::vector<double>& times,
                      BaProblem* problem);

}  // namespace vip_slam
