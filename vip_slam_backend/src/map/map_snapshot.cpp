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

}  // namespace vip_slam
