// What this process holds in memory.
#pragma once

namespace vip_slam {

/// Resident size in megabytes; 0 when the system does not tell.
double processMemoryMb();

}  // namespace vip_slam
