// SPDX-License-Identifier: BSD-3-Clause
// Checks of a place match that are independent of its feature points: whether the depth images and the planes of the
// two keyframes describe one scene.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"

namespace vip_slam {

struct DepthAgreement {
  int compared = 0;     ///< nodes of either grid that project into the other
  int agree = 0;        ///< on the same surface
  int see_through = 0;  ///< the other camera sees a farther surface: this one cannot be there
  int occluded = 0;     ///< the other camera sees a nearer surface
  double agreement() const { return compared ? static_cast<double>(agree) / compared : 0; }
  double seeThrough() const { return compared ? static_cast<double>(see_through) / compared : 0; }
};

/// How far a reading may be from the surface that it shows, m along the optical axis, with the errors of the poses that
/// are compared.
inline double depthSlack(double z) { return 0.05 + 0.025 * z; }

/// Warps each grid into the other camera; T_a_b maps points of camera b into camera a.
DepthAgreement compareDepth(const DepthGrid& a, const DepthGrid& b, const SE3& T_a_b, const CameraModel& camera);

struct PlaneAgreement {
  std::vector<std::pair<PlaneId, PlaneId>> same;  ///< (plane of the query, plane of the match): one surface
  int contradictions = 0;                         ///< overlapping parallel surfaces, seen from one side, with an offset
};

/// Compares the planes seen by `query` keyframes with those seen by `match` keyframes, where `T_W_W` moves the query's
/// part of the map onto the match's. Planes seen by both are not compared.
PlaneAgreement comparePlanes(const Map& map, const std::set<KeyframeId>& query, const std::set<KeyframeId>& match,
                             const SE3& T_W_W);

}  // namespace vip_slam
