// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/growth/moved_surface.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vip_slam {
namespace {

constexpr std::size_t kMinBefore = 3, kMinSince = 4;  // observations
constexpr double kMoved = 0.02;                       // m
constexpr double kScatter = 0.25;                     // largest scatter of each group, relative to the shift
constexpr double kSamePlace = 0.4;                    // distance of centroids, relative to the root of the area

struct Seen {
  KeyframeId keyframe;
  double offset;          // m, along the normal
  Eigen::Vector2d place;  // in the plane's frame
};

struct Group {
  double mean = 0, deviation = 0;
};

Group groupOf(std::vector<Seen>::const_iterator begin, std::vector<Seen>::const_iterator end) {
  Group group;
  const double n = double(end - begin);
  for (auto it = begin; it != end; ++it) group.mean += it->offset / n;
  for (auto it = begin; it != end; ++it) group.deviation += std::pow(it->offset - group.mean, 2) / n;
  group.deviation = std::sqrt(group.deviation);
  return group;
}

}  // namespace

KeyframeId surfaceMovedAt(const PlaneTrack& track, const CameraPoses& poses) {
  std::vector<Seen> seen;
  for (const auto& [keyframe, observation] : track.observations()) {
    const auto pose = poses.find(keyframe);
    if (pose == poses.end() || !(observation.G(3, 3) > 0)) continue;
    const Eigen::Vector3d centre = pose->second * PlaneMoments{observation.G}.centroid();
    seen.push_back({keyframe, track.plane().signedDistance(centre), track.toPlane(centre)});
  }
  if (seen.size() < kMinBefore + kMinSince) return 0;
  KeyframeId moved_at = 0;
  double least = 1;  // scatter over shift
  for (auto since = seen.begin() + kMinBefore; since + kMinSince <= seen.end(); ++since) {
    const Group before = groupOf(seen.begin(), since), after = groupOf(since, seen.end());
    const double way = std::abs(after.mean - before.mean), most = std::max(before.deviation, after.deviation);
    if (way < kMoved || most > kScatter * way || most > least * way) continue;
    const double reach = kSamePlace * std::sqrt(track.area());
    const auto shown_before = [&](const Seen& s) {
      return std::any_of(seen.begin(), since, [&](const Seen& b) { return (b.place - s.place).norm() < reach; });
    };
    if (2 * std::count_if(since, seen.end(), shown_before) < seen.end() - since) continue;
    least = most / way;
    moved_at = since->keyframe;
  }
  return moved_at;
}

}  // namespace vip_slam
