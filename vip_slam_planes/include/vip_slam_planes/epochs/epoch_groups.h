// SPDX-License-Identifier: BSD-3-Clause
// Groups of odometry epochs whose relative pose is known, as reported by the back end. The place of a new epoch in the
// map is a guess until a loop closure or relocalisation ties it to another one; only within a group of tied epochs are
// views evidence for or against planes.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "vip_slam_core/types/map_update.h"

namespace vip_slam {

class EpochGroups {
 public:
  /// Adds an epoch; it is a group by itself until it is tied.
  void add(std::uint32_t epoch) { group_.emplace(epoch, epoch); }
  /// Ties are permanent: epochs that are no longer named keep their group. True when known groups were joined.
  bool tie(const std::vector<EpochPart>& parts);
  bool tied(std::uint32_t a, std::uint32_t b) const { return groupOf(a) == groupOf(b); }
  bool allTied() const;
  void clear() { group_.clear(); }

 private:
  std::uint32_t groupOf(std::uint32_t epoch) const;

  std::map<std::uint32_t, std::uint32_t> group_;  ///< named by one of its epochs
};

}  // namespace vip_slam
