// Which epochs of the odometry lie in one frame, as the back end tells. Where a new epoch lies in the map is a guess
// until a loop closure or relocalisation ties it to another one; only within a group of tied epochs do views speak for
// or against planes.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "vip_slam_core/types/map_update.h"

namespace vip_slam {

class EpochGroups {
 public:
  /// An epoch; one of which nothing has been told is a group by itself.
  void add(std::uint32_t epoch) { group_.emplace(epoch, epoch); }
  /// Ties are for good: epochs that are no longer named stay where they were. True when epochs have come together that
  /// were known apart.
  bool tie(const std::vector<EpochPart>& parts);
  bool tied(std::uint32_t a, std::uint32_t b) const { return groupOf(a) == groupOf(b); }
  bool allTied() const;
  void clear() { group_.clear(); }

 private:
  std::uint32_t groupOf(std::uint32_t epoch) const;

  std::map<std::uint32_t, std::uint32_t> group_;  ///< named by one of its epochs
};

}  // namespace vip_slam
