// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/scene_agreement.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/depth/sight.h"
#include "vip_slam_core/geometry/angle.h"

namespace vip_slam {
namespace {

void warp(const DepthGrid& from, const DepthGrid& into, const SE3& T_into_from, const CameraModel& camera,
          DepthAgreement* count) {
  for (int r = 0; r < from.rows; ++r)
    for (int c = 0; c < from.cols; ++c) {
      const double z = from.at(c, r);
      if (z <= 0) continue;
      const Eigen::Vector3d p = T_into_from * camera.unproject(from.pixel(c, r), z);
      const Sight sight = sightLine(into, camera, p).at(p.z(), depthSlack(p.z()));
      if (sight == Sight::kOutside || sight == Sight::kNothing) continue;
      ++count->compared;
      count->see_through += sight == Sight::kThrough;
      count->occluded += sight == Sight::kHidden;
      count->agree += sight == Sight::kThere;
    }
}

struct Patch {
  Plane plane;                          ///< in the world of the match
  std::vector<Eigen::Vector3d> points;  ///< samples of the surface, same world
};

// The planes some keyframes see, with samples of their surface.
std::map<PlaneId, Patch> patches(const Map& map, const std::set<KeyframeId>& keyframes, const SE3& T_W_W) {
  std::map<PlaneId, Patch> result;
  for (const KeyframeId id : keyframes) {
    if (!map.hasKeyframe(id)) continue;
    const MapKeyframe& kf = map.keyframe(id);
    const SE3 T_W_C = T_W_W * kf.T_W_C();
    for (const auto& entry : kf.planes) {
      const auto plane = map.planes().find(entry.first);
      if (plane == map.planes().end()) continue;
      Patch& patch = result[entry.first];
      patch.plane = transformPlane(T_W_W, plane->second.estimate.plane);
      const std::size_t step = std::max<std::size_t>(1, entry.second.points.size() / 40);
      for (std::size_t k = 0; k < entry.second.points.size(); k += step)
        patch.points.push_back(T_W_C * entry.second.points[k].p_C.cast<double>());
    }
  }
  return result;
}

bool overlap(const Patch& a, const Patch& b) {
  int close = 0;
  for (const Eigen::Vector3d& p : a.points)
    for (const Eigen::Vector3d& q : b.points) {
      const Eigen::Vector3d d = p - q;
      if ((d - a.plane.n.dot(d) * a.plane.n).norm() < 0.25 && ++close >= 5) return true;
    }
  return false;
}

}  // namespace

DepthAgreement compareDepth(const DepthGrid& a, const DepthGrid& b, const SE3& T_a_b, const CameraModel& camera) {
  DepthAgreement result;
  if (a.empty() || b.empty()) return result;
  warp(b, a, T_a_b, camera, &result);
  warp(a, b, T_a_b.inverse(), camera, &result);
  return result;
}

PlaneAgreement comparePlanes(const Map& map, const std::set<KeyframeId>& query, const std::set<KeyframeId>& match,
                             const SE3& T_W_W) {
  constexpr double kAngle = 4.0 * kDegree, kSame = 0.08, kContradiction = 0.6;
  PlaneAgreement result;
  const auto ours = patches(map, query, T_W_W), theirs = patches(map, match, SE3());
  for (const auto& a : ours) {
    if (theirs.count(a.first)) continue;
    bool same = false, contradicted = false;
    for (const auto& b : theirs) {
      if (ours.count(b.first)) continue;
      if (a.second.plane.n.dot(b.second.plane.n) < std::cos(kAngle) || !overlap(a.second, b.second)) continue;
      double distance = 0;
      for (const Eigen::Vector3d& p : a.second.points) distance += std::abs(b.second.plane.signedDistance(p));
      distance /= std::max<std::size_t>(1, a.second.points.size());
      if (distance < kSame) {
        result.same.emplace_back(a.first, b.first);
        same = true;
      } else if (distance < kContradiction) {
        contradicted = true;
      }
    }
    result.contradictions += contradicted && !same;
  }
  return result;
}

}  // namespace vip_slam
