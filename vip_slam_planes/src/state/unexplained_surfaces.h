// SPDX-License-Identifier: BSD-3-Clause
// What the last keyframes show of surfaces that no plane explains. A keyframe's own planes are detected first; each of
// its triangles that is left over then, and each strip, is kept until several keyframes together make it a plane.
#pragma once

#include <utility>
#include <vector>

#include "vip_slam_planes/detection/plane_evidence.h"
#include "vip_slam_planes/detection/strip_evidence.h"

namespace vip_slam::planes {

class UnexplainedSurfaces {
 public:
  explicit UnexplainedSurfaces(const PlaneMapperOptions& options)
      : patches_(options.detection, options.growth), strips_(options.detection, options.growth) {}

  /// Number of keyframes with at least `area` m^2 of left-over triangles on the plane.
  int seenBy(const PlaneTrack& plane, const CameraPoses& poses, double area) const {
    return patches_.seenBy(plane, poses, area);
  }
  /// Triangles that one of the planes in view has grown up to since, each with that plane; they are no longer kept.
  std::vector<std::pair<const PlaneTrack*, EvidenceTriangle>> takeJoining(const CameraPoses& poses,
                                                                          const std::vector<const PlaneTrack*>& known) {
    return patches_.takeJoining(poses, known);
  }

  /// Keeps the triangles without label (< 0) of a keyframe; the planes that they make with those of earlier keyframes.
  /// `beside`: the plane that each triangle is another layer of (other_layers.h), 0: none. `known`: the planes in view.
  std::vector<JointPlane> addTriangles(KeyframeId id, const std::vector<MapTriangle>& triangles,
                                       const std::vector<int>& label, const std::vector<PlaneId>& beside,
                                       const CameraPoses& poses, const std::vector<const PlaneTrack*>& known);
  /// The same for the strips of detectPlanes(). Called last: those whose triangles have a label by now are not kept.
  std::vector<JointPlane> addStrips(KeyframeId id, const std::vector<MapTriangle>& triangles,
                                    const std::vector<int>& label, std::vector<DetectedPlane> strips,
                                    const CameraPoses& poses);

  void remove(KeyframeId id);
  /// Keyframes have moved relative to each other: what was refused before is tested again.
  void forgetTests() { patches_.forgetTests(); }
  void clear();

 private:
  PlaneEvidence patches_;
  StripEvidence strips_;
};

}  // namespace vip_slam::planes
