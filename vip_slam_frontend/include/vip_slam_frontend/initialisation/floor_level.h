// SPDX-License-Identifier: BSD-3-Clause
// What is level without an accelerometer: the floor, or a table, that the first depth image shows.
#pragma once

#include <optional>
#include <vector>

#include "vip_slam_frontend/tracking/patch_grouping.h"

namespace vip_slam::frontend {

/// What the vertical of the first pose was taken from.
enum class Level { kAccelerometer, kFloor, kCamera };

/// In words, as "the floor".
const char* levelName(Level level);

/// Up, a unit vector in the camera frame: the normal of the largest plane that faces up in a camera which is held about
/// upright (x right, y down). Empty when none is large enough. A camera that is held on its side, or looks up steeply,
/// may take a wall for it.
std::optional<Eigen::Vector3d> upByFloor(const std::vector<SurfacePatch>& on_planes);

}  // namespace vip_slam::frontend
