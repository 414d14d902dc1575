// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/epochs/epoch_groups.h"

#include <algorithm>

namespace vip_slam {

bool EpochGroups::tie(const std::vector<EpochPart>& parts) {
  bool came_together = false;
  for (const EpochPart& told : parts) {
    add(told.part);
    const std::uint32_t into = group_.at(told.part);
    const auto [known, fresh] = group_.emplace(told.epoch, into);
    const std::uint32_t from = known->second;
    if (fresh || from == into) continue;
    came_together = true;
    for (auto& [epoch, group] : group_) {
      if (group == from) group = into;
    }
  }
  return came_together;
}

bool EpochGroups::allTied() const {
  return std::all_of(group_.begin(), group_.end(),
                     [this](const auto& entry) { return entry.second == group_.begin()->second; });
}

std::uint32_t EpochGroups::groupOf(std::uint32_t epoch) const {
  const auto it = group_.find(epoch);
  return it == group_.end() ? epoch : it->second;
}

}  // namespace vip_slam
