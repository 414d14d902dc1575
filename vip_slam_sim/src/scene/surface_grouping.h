// SPDX-License-Identifier: BSD-3-Clause
// Coplanar pieces that touch each other become one physical plane.
#pragma once

#include "vip_slam_sim/scene/scene.h"

namespace vip_slam {

/// Fills Scene::surfaces and Chart::surface.
void groupSurfaces(Scene* scene);

}  // namespace vip_slam
