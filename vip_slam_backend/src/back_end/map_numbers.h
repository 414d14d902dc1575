// SPDX-License-Identifier: BSD-3-Clause
// Numbers that outlive a reset: by them what still refers to an earlier map is known.
#pragma once

#include <cstdint>

#include "vip_slam_backend/map_io/map_file.h"

namespace vip_slam::backend {

class MapNumbers {
 public:
  /// Revision of the newest update.
  std::uint64_t revision() const { return revision_; }
  std::uint64_t nextRevision() { return ++revision_; }
  /// Whether an answer to this revision is about the present map.
  bool ofThisMap(std::uint64_t revision) const { return revision >= first_; }
  /// Another map begins: what answers to updates up to now is not about it.
  void startMap() { first_ = revision_ + 1; }

  /// Where the ids of the next loaded map's landmarks begin: apart from those of the last ones.
  LandmarkId loadedLandmarks() const { return kLoadedLandmarks + (loads_ % kMaxLoads) * kLoadedApart; }
  void loaded() { ++loads_; }

 private:
  static constexpr std::uint64_t kMaxLoads = 4096;  ///< loads until ranges of ids are used again
  std::uint64_t revision_ = 0, first_ = 0, loads_ = 0;
};

}  // namespace vip_slam::backend
