// What one image shows at two depths is two surfaces, though both are near enough to a plane to join it.
#pragma once

#include <vector>

#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/mesh/map_triangles.h"

namespace vip_slam {

/// Takes the label from triangles that lie on another layer than those nearest to their plane: a board 4 cm before a
/// wall is a surface of its own. A pose that is off moves all layers alike and takes none. `label` as of
/// associateTriangles().
void releaseOtherLayers(const std::vector<MapTriangle>& triangles, const std::vector<const PlaneTrack*>& tracks,
                        std::vector<int>* label);

}  // namespace vip_slam
