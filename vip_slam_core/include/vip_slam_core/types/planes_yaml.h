// SPDX-License-Identifier: BSD-3-Clause
// Plane maps as YAML: true and found planes share one layout, to which the truth adds seen_seconds and seen_area.
//   planes: [{id, kind: horizontal|vertical|general, normal: [x,y,z], distance, area, polygons: [{outer: [[x,y,z],...],
//   holes: [...]}]}]
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/types/true_plane.h"

namespace vip_slam {

/// Throw std::runtime_error naming file, plane and key. Either reads the other's files: what only the truth has is left
/// out, or not known.
std::vector<PlaneEstimate> readPlanesYaml(const std::string& path);
std::vector<TruePlane> readTruePlanesYaml(const std::string& path);
void writePlanesYaml(const std::string& path, const std::vector<PlaneEstimate>& planes);
void writeTruePlanesYaml(const std::string& path, const std::vector<TruePlane>& planes);

}  // namespace vip_slam
