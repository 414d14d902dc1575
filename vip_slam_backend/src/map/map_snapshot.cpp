// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/map/map_snapshot.h"

#include <algorithm>

namespace vip_slam {

std::vector<Anchor> anchorsOf(const MapSnapshot& snapshot) {
  std::vector<Anchor> anchors;
  for (const SnapshotKeyframe& kf : snapshot.keyframes)
    anchors.push_back({kf.t, kf.epoch, kf.T_chain_C, kf.state.T_W_I, kf.T_I_C});
  anchors.insert(anchors.end(), snapshot.localised.begin(), snapshot.localised.end());
  std::stable_sort(anchors.begin(), anchors.end(), [](const Anchor& a, const Anchor& b) { return a.t < b.t; });
  return anchors;
}

std::vector<std::pair<double, double>> guessedTimes(const MapSnapshot& snapshot) {
  std::vector<std::pair<double, double>> times;
  bool goes_on = false;
  for (const SnapshotKeyframe& kf : snapshot.keyframes) {
    const bool guessed = !kf.placed && !kf.stored;
    if (guessed && !goes_on) times.emplace_back(kf.t, kf.t);
    if (guessed) times.back().second = kf.t;
    goes_on = guessed;
  }
  return times;
}

}  // namespace vip_slam
