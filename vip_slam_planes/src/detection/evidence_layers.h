// SPDX-License-Identifier: BSD-3-Clause
// Which left-over triangles of several keyframes belong to planes that are known by now.
#pragma once

#include <vector>

#include "vip_slam_planes/detection/plane_evidence.h"

namespace vip_slam {

std::vector<MapTriangle> trianglesOf(const std::vector<EvidenceTriangle>& evidence);

/// Whether each triangle belongs to the plane that `label`, from associateTriangles(), gives it. What an earlier
/// keyframe left over, when the plane did not reach there yet, belongs to the layer beside the plane where it lies
/// nearer to that.
std::vector<char> belongsTo(const std::vector<const PlaneTrack*>& known, const std::vector<EvidenceTriangle>& evidence,
                            const std::vector<int>& label);

}  // namespace vip_slam
