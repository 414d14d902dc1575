// SPDX-License-Identifier: BSD-3-Clause
#include "loop_journal.h"

#include <algorithm>

namespace vip_slam {
namespace {

// Number of refused loops that are kept; a day has about a hundred thousand.
constexpr std::size_t kMaxRefused = 1000;

}  // namespace

void LoopJournal::add(const LoopEvent& event) {
  new_.push_back(event);
  kept_.push_back(event);
  refused_ += !event.accepted;
  if (refused_ <= kMaxRefused) return;
  kept_.erase(std::find_if(kept_.begin(), kept_.end(), [](const LoopEvent& e) { return !e.accepted; }));
  --refused_;
}

}  // namespace vip_slam
