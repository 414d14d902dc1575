// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/types/landmark_aliases.h"

#include <utility>

namespace vip_slam {

LandmarkId LandmarkAliases::resolve(LandmarkId id) const {
  for (auto it = now_.find(id); it != now_.end(); it = now_.find(id)) id = it->second;
  return id;
}

void LandmarkAliases::forgetUnused(const std::unordered_set<LandmarkId>& in_use) {
  std::unordered_map<LandmarkId, LandmarkId> kept;
  for (const auto& alias : now_) {
    if (in_use.count(alias.first)) kept[alias.first] = resolve(alias.second);  // those in between may go
  }
  now_ = std::move(kept);
  kept_ = now_.size();
}

void LandmarkAliases::clear() {
  now_.clear();
  kept_ = 0;
}

}  // namespace vip_slam
