// Which epochs of the odometry lie in one frame. Where a new epoch lies in the map is a guess until a loop closure or
// relocalisation ties it to another one; only within a group of tied epochs do views speak for or against planes.
#pragma once

#include <cstdint>
#include <map>

#include "vip_slam_core/types/keyframe.h"

namespace vip_slam {

/// An epoch, or kLoadedEpoch for all that came with a loaded map.
using EpochKey = std::int64_t;
constexpr EpochKey kLoadedEpoch = -1;

class EpochGroups {
 public:
  /// There is a loaded map: no epoch belongs to it before a loop or relocalisation says so.
  void addLoaded();
  /// The back end has placed a keyframe. Without a loaded map the first epoch is the map's own.
  void place(KeyframeId id, EpochKey epoch);
  /// Of a keyframe, also of one that is gone; ids before the first placed one are those of a loaded map.
  EpochKey epochOf(KeyframeId id) const;
  /// Returns true when the two were apart before.
  bool tie(EpochKey a, EpochKey b);
  bool tied(EpochKey a, EpochKey b) const { return groupOf(a) == groupOf(b); }
  bool allTied() const;
  void clear();

 private:
  EpochKey groupOf(EpochKey epoch) const;

  std::map<KeyframeId, EpochKey> first_;  ///< keyframe from which on an epoch runs: ids only ever grow
  std::map<EpochKey, EpochKey> group_;    ///< named by one of its epochs
};

}  // namespace vip_slam
