// SPDX-License-Identifier: BSD-3-Clause
// The loops of a session: all accepted ones, the newest refused ones, and those since the last update.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "vip_slam_core/types/map_update.h"

namespace vip_slam {

class LoopJournal {
 public:
  void add(const LoopEvent& event);
  const std::vector<LoopEvent>& kept() const { return kept_; }
  /// Those added since the last call.
  std::vector<LoopEvent> takeNew() { return std::exchange(new_, {}); }

 private:
  std::vector<LoopEvent> kept_, new_;
  std::size_t refused_ = 0;  ///< number of refused ones that are kept
};

}  // namespace vip_slam
