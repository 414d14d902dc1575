// SPDX-License-Identifier: BSD-3-Clause
// What a session has to say for itself: refusals, notices, loops and counters, for people and for /diagnostics.
#pragma once

#include <string>

#include "loop_journal.h"
#include "message_log.h"
#include "vip_slam_backend/map/map_snapshot.h"

namespace vip_slam::backend {

struct Report {
  std::string refusal;  ///< of the last keyframe; empty when it was taken
  MessageLog refusals, notices;
  LoopJournal loops;
  BackEndStatistics statistics;

  /// A keyframe was refused.
  void refused(const std::string& why) {
    refusal = why;
    refusals.add(why);
  }
};

}  // namespace vip_slam::backend
