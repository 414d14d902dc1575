// SPDX-License-Identifier: BSD-3-Clause
// Memory of this process.
#pragma once

namespace vip_slam {

/// Resident size in megabytes; 0 when it is not available.
double processMemoryMb();

}  // namespace vip_slam
