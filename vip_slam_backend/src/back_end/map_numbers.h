// SPDX-License-Identifier: BSD-3-Clause
// Numbers that outlive a reset: by them what still refers to an earlier map is known.
#pragma once

#include <cstdint>
#include <limits>

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
  LandmarkId loadedLandmarks() const {
    // After so many loads their ranges are used again.
    const std::uint64_t ranges = std::numeric_limits<LandmarkId>::max() / kLoadedApart;
    return kLoadedLandmarks + static_cast<LandmarkId>(loads_ % ranges) * kLoadedApart;
  }
  void loaded() { ++loads_; }

 private:
  std::uint64_t revision_ = 0, first_ = 0, loads_ = 0;
};

}  // namespace vip_slam::backend
