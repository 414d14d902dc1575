// SPDX-License-Identifier: BSD-3-Clause
#include "unexplained_surfaces.h"

#include <algorithm>

namespace vip_slam::planes {

std::vector<JointPlane> UnexplainedSurfaces::addTriangles(KeyframeId id, const std::vector<MapTriangle>& triangles,
                                                          const std::vector<int>& label,
                                                          const std::vector<PlaneId>& beside, const CameraPoses& poses,
                                                          const std::vector<const PlaneTrack*>& known) {
  patches_.add(id, poses.at(id), triangles, label, beside);
  return patches_.detect(poses, known);
}

std::vector<JointPlane> UnexplainedSurfaces::addStrips(KeyframeId id, const std::vector<MapTriangle>& triangles,
                                                       const std::vector<int>& label, std::vector<DetectedPlane> strips,
                                                       const CameraPoses& poses) {
  const auto explained = [&](const DetectedPlane& strip) {
    return std::any_of(strip.triangles.begin(), strip.triangles.end(), [&](int i) { return label[i] >= 0; });
  };
  strips.erase(std::remove_if(strips.begin(), strips.end(), explained), strips.end());
  strips_.add(id, poses.at(id), triangles, label, strips);
  return strips_.detect(poses);
}

void UnexplainedSurfaces::remove(KeyframeId id) {
  patches_.remove(id);
  strips_.remove(id);
}

void UnexplainedSurfaces::clear() {
  patches_.clear();
  strips_.clear();
}

}  // namespace vip_slam::planes
