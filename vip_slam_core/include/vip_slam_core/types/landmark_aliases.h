// SPDX-License-Identifier: BSD-3-Clause
// Landmarks that were merged: the id under which a track is known now. Tracks keep the id that the front end gave them.
#pragma once

#include <cstddef>
#include <unordered_map>
#include <unordered_set>

#include "vip_slam_core/types/feature.h"

namespace vip_slam {

class LandmarkAliases {
 public:
  /// `from` is known as `into` from now on. Both must be names in use, not aliases themselves.
  void merge(LandmarkId from, LandmarkId into) { now_[from] = into; }
  bool isAlias(LandmarkId id) const { return now_.count(id) != 0; }
  /// Follows merges; the id itself when it was never merged.
  LandmarkId resolve(LandmarkId id) const;

  /// Whether so many were added since the last forgetUnused() that another call pays.
  bool crowded() const { return now_.size() > 2 * kept_ + kFew; }
  /// Keeps the aliases in `in_use`, so that their number is bounded by the tracks that keyframes still contain.
  void forgetUnused(const std::unordered_set<LandmarkId>& in_use);
  std::size_t size() const { return now_.size(); }
  void clear();

 private:
  static constexpr std::size_t kFew = 1000;
  std::unordered_map<LandmarkId, LandmarkId> now_;
  std::size_t kept_ = 0;
};

}  // namespace vip_slam
