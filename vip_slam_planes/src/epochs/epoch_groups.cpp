#include "vip_slam_planes/epochs/epoch_groups.h"

#include <algorithm>
#include <iterator>

namespace vip_slam {

void EpochGroups::place(KeyframeId id, EpochKey epoch) {
  if (!group_.count(kLoadedEpoch)) tie(epoch, kLoadedEpoch);
  group_.emplace(epoch, epoch);
  if (epochOf(id) != epoch) first_[id] = epoch;
}

void EpochGroups::addLoaded() { group_.emplace(kLoadedEpoch, kLoadedEpoch); }

EpochKey EpochGroups::epochOf(KeyframeId id) const {
  const auto next = first_.upper_bound(id);
  return next == first_.begin() ? kLoadedEpoch : std::prev(next)->second;
}

bool EpochGroups::tie(EpochKey a, EpochKey b) {
  const EpochKey into = group_.emplace(a, a).first->second, from = group_.emplace(b, b).first->second;
  if (into == from) return false;
  for (auto& [epoch, group] : group_) {
    if (group == from) group = into;
  }
  return true;
}

bool EpochGroups::allTied() const {
  return std::all_of(group_.begin(), group_.end(),
                     [this](const auto& entry) { return entry.second == group_.begin()->second; });
}

void EpochGroups::clear() {
  first_.clear();
  group_.clear();
}

EpochKey EpochGroups::groupOf(EpochKey epoch) const {
  const auto it = group_.find(epoch);
  return it == group_.end() ? epoch : it->second;
}

}  // namespace vip_slam
