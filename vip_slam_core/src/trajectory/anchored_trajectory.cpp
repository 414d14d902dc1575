#include "vip_slam_core/trajectory/anchored_trajectory.h"

#include <algorithm>
#include <map>

namespace vip_slam {
namespace {

SE3 carry(const Anchor& anchor, const ChainedPose& pose) {
  return anchor.T_map_I * (anchor.T_I_C * (anchor.T_chain_C.inverse() * pose.T_chain_C) * anchor.T_I_C.inverse());
}

}  // namespace

Trajectory anchorTrajectory(const std::vector<ChainedPose>& chain, const std::vector<Anchor>& anchors) {
  std::map<std::uint32_t, std::vector<const Anchor*>> by_epoch;
  for (const Anchor& anchor : anchors) by_epoch[anchor.epoch].push_back(&anchor);

  Trajectory trajectory;
  trajectory.reserve(chain.size());
  for (const ChainedPose& pose : chain) {
    const auto epoch = by_epoch.find(pose.epoch);
    if (epoch == by_epoch.end()) continue;
    const auto& list = epoch->second;
    const auto after =
        std::lower_bound(list.begin(), list.end(), pose.t, [](const Anchor* a, double t) { return a->t < t; });
    if (after == list.begin()) {
      trajectory.push_back({pose.t, carry(**after, pose)});
    } else if (after == list.end()) {
      trajectory.push_back({pose.t, carry(*list.back(), pose)});
    } else {
      const Anchor &a = **std::prev(after), &b = **after;
      trajectory.push_back({pose.t, interpolate(carry(a, pose), carry(b, pose), (pose.t - a.t) / (b.t - a.t))});
    }
  }
  return trajectory;
}

}  // namespace vip_slam
