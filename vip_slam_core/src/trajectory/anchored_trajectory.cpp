// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/trajectory/anchored_trajectory.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace vip_slam {
namespace {

SE3 carry(const Anchor& anchor, const ChainedPose& pose) {
  return anchor.T_map_I * (anchor.T_I_C * (anchor.T_chain_C.inverse() * pose.T_chain_C) * anchor.T_I_C.inverse());
}

// Drift that the chain of one epoch has gathered since its first image, m; one image after the other, ascending in t.
class Drift {
 public:
  void add(const ChainedPose& pose) {
    if (!times_.empty())
      gathered_.push_back(gathered_.back() + (pose.t - times_.back()) * (kLeast + 0.5 * (last_ + pose.sigma_velocity)));
    else
      gathered_.push_back(0);
    times_.push_back(pose.t);
    last_ = pose.sigma_velocity;
  }
  double at(double t) const {
    const auto after = std::lower_bound(times_.begin(), times_.end(), t);
    if (after == times_.begin()) return gathered_.front();
    if (after == times_.end()) return gathered_.back();
    const std::size_t i = after - times_.begin();
    const double share = (t - times_[i - 1]) / (times_[i] - times_[i - 1]);
    return gathered_[i - 1] + share * (gathered_[i] - gathered_[i - 1]);
  }

 private:
  static constexpr double kLeast = 1e-3;  // m/s, that of good tracking: standing still drifts, too

  std::vector<double> times_, gathered_;
  double last_ = 0;
};

}  // namespace

double velocitySigma(const Matrix15d& covariance) {
  return std::sqrt(std::max(0.0, covariance.diagonal().segment<3>(6).sum()));
}

Trajectory anchorTrajectory(const std::vector<ChainedPose>& chain, const std::vector<Anchor>& anchors) {
  std::map<std::uint32_t, std::vector<const Anchor*>> by_epoch;
  for (const Anchor& anchor : anchors) by_epoch[anchor.epoch].push_back(&anchor);

  std::map<std::uint32_t, Drift> drift;
  for (const ChainedPose& pose : chain) drift[pose.epoch].add(pose);

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
      const Drift& gathered = drift.at(pose.epoch);
      const double begin = gathered.at(a.t), end = gathered.at(b.t);
      const double share = end > begin ? (gathered.at(pose.t) - begin) / (end - begin) : 1.0;
      trajectory.push_back({pose.t, interpolate(carry(a, pose), carry(b, pose), share)});
    }
  }
  return trajectory;
}

}  // namespace vip_slam
