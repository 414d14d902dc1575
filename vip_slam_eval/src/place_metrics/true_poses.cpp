// SPDX-License-Identifier: BSD-3-Clause
#include "place_metrics/true_poses.h"

#include <cmath>
#include <stdexcept>
#include <vector>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_eval/metrics/trajectory_metrics.h"

namespace vip_slam {

TruePoses truePoses(const Map& map, const Trajectory& truth) {
  TruePoses poses;
  for (const auto& entry : map.keyframes()) {
    const TrackedFrame& frame = entry.second.data->frame;
    SE3 T;
    if (poseAt(truth, frame.t + frame.time_offset, &T)) poses[entry.first] = T;
  }
  return poses;
}

SE3 alignMap(const Map& map, const TruePoses& truth) {
  if (truth.empty())
    throw std::invalid_argument("truth: has no pose at the time of any keyframe, expected at least one");
  std::vector<PosePair> pairs;
  for (const auto& entry : truth) {
    const MapKeyframe& kf = map.keyframe(entry.first);
    pairs.push_back({kf.data->frame.t, entry.second, kf.state.T_W_I});
  }
  return align(pairs, Alignment::kYaw);
}

bool samePlace(const SE3& a, const SE3& b, double metres) {
  return (a.t() - b.t()).norm() <= metres && a.rotation().angularDistance(b.rotation()) <= 30 * kDegree;
}

}  // namespace vip_slam
