// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/growth/moved_surface.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vip_slam_core/util/significance.h"

namespace vip_slam {
namespace {

struct Seen {
  KeyframeId keyframe;
  double offset;          // m, along the normal
  Eigen::Vector2d place;  // in the plane's frame
  double spread;          // m, of its samples
};

struct Group {
  double mean = 0, variance = 0;
};

Group groupOf(std::vector<Seen>::const_iterator begin, std::vector<Seen>::const_iterator end) {
  Group group;
  const double n = double(end - begin);
  for (auto it = begin; it != end; ++it) group.mean += it->offset / n;
  for (auto it = begin; it != end; ++it) group.variance += std::pow(it->offset - group.mean, 2) / (n - 1);
  return group;
}

}  // namespace

KeyframeId surfaceMovedAt(const PlaneTrack& track, const CameraPoses& poses, int min_views, double min_shift) {
  std::vector<Seen> seen;
  for (const auto& [keyframe, observation] : track.observations()) {
    const auto pose = poses.find(keyframe);
    if (pose == poses.end() || !(observation.G(3, 3) > 0)) continue;
    const PlaneMoments moments{observation.G};
    const Eigen::Vector3d centre = pose->second * moments.centroid();
    seen.push_back({keyframe, track.plane().signedDistance(centre), track.toPlane(centre), moments.spread()});
  }
  if (seen.size() < 2 * std::size_t(min_views)) return 0;
  KeyframeId moved_at = 0;
  double least = 1 / kNoiseSigmas;  // scatter over shift
  for (auto since = seen.begin() + min_views; since + min_views <= seen.end(); ++since) {
    const Group before = groupOf(seen.begin(), since), after = groupOf(since, seen.end());
    const double shift = std::abs(after.mean - before.mean), scatter = std::sqrt(before.variance + after.variance);
    if (shift < min_shift || !(scatter < least * shift)) continue;
    const auto shown_before = [&](const Seen& s) {
      return std::any_of(seen.begin(), since,
                         [&](const Seen& b) { return (b.place - s.place).norm() < b.spread + s.spread; });
    };
    if (2 * std::count_if(since, seen.end(), shown_before) < seen.end() - since) continue;
    least = scatter / shift;
    moved_at = since->keyframe;
  }
  return moved_at;
}

}  // namespace vip_slam
