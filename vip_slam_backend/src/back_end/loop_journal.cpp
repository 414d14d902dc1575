// SPDX-License-Identifier: BSD-3-Clause
#include "loop_journal.h"

#include <algorithm>

#include "message_log.h"

namespace vip_slam {

void LoopJournal::add(const LoopEvent& event) {
  new_.push_back(event);
  kept_.push_back(event);
  refused_ += !event.accepted;
  if (refused_ <= kMostKept) return;
  kept_.erase(std::find_if(kept_.begin(), kept_.end(), [](const LoopEvent& e) { return !e.accepted; }));
  --refused_;
}

}  // namespace vip_slam
