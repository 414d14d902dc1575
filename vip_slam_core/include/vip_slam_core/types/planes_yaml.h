// Plane maps as YAML: the simulator's truth and the system's result share one layout; the truth adds seen_seconds and
// seen_area.
//   planes: [{id, kind: horizontal|vertical|general, normal: [x,y,z], distance, area, polygons: [{outer: [[x,y,z],...],
//   holes: [...]}]}]
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// Throws std::runtime_error naming file, plane and key.
std::vector<PlaneEstimate> readPlanesYaml(const std::string& path);
void writePlanesYaml(const std::string& path, const std::vector<PlaneEstimate>& planes);

}  // namespace vip_slam
