// SPDX-License-Identifier: BSD-3-Clause
// Thread priorities: mapping yields to tracking.
#pragma once

namespace vip_slam {

/// Nice values added: of map and planes relative to the odometry, and of the global adjustment relative to those.
constexpr int kMappingNiceness = 5, kAdjustmentNiceness = 5;

/// Adds `niceness` to the nice value of the calling thread, and of threads that it starts from now on, so that they
/// yield to others of the process. Needs no privilege; has no effect where threads have no nice value of their own.
void lowerThreadPriority(int niceness);

}  // namespace vip_slam
