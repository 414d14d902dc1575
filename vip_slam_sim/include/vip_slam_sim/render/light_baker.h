// SPDX-License-Identifier: BSD-3-Clause
// Bakes direct light of the lamps (with soft shadows) and ambient light (with contact shading) into light maps.
#pragma once

#include "vip_slam_sim/render/ray_tracer.h"
#include "vip_slam_sim/scene/scene.h"

namespace vip_slam {

/// Fills Scene::light. `spacing_scale` > 1 coarsens the maps (tests). Deterministic whatever the number of threads.
void bakeLight(Scene* scene, const RayTracer& tracer, int threads, double spacing_scale = 1.0);

}  // namespace vip_slam
