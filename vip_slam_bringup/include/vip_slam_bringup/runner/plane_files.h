// SPDX-License-Identifier: BSD-3-Clause
// Export of planes: a mesh, and a floor plan.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// ASCII PLY with coloured vertices and triangles, in `map`, metres.
void writePlanesPly(const std::string& path, const std::vector<PlaneEstimate>& planes);

/// SVG seen from above, metres to scale: vertical planes as walls, the lowest large horizontal planes as floor, the
/// trajectory as a line, a scale bar. Both throw std::runtime_error naming the file that cannot be written.
void writeFloorPlan(const std::string& path, const std::vector<PlaneEstimate>& planes, const Trajectory& trajectory);

}  // namespace vip_slam
