// Threads that may wait for those that must not: mapping gives way to tracking.
#pragma once

namespace vip_slam {

/// How far what a keyframe brings to map and planes stands behind the odometry, and the global adjustment behind that.
constexpr int kMappingNiceness = 5, kAdjustmentNiceness = 5;

/// The calling thread, and threads that it starts from now on, become nicer by so much: they give way to the others of
/// the process. Needs no privilege; where threads have no niceness of their own nothing changes.
void lowerThreadPriority(int niceness);

}  // namespace vip_slam
