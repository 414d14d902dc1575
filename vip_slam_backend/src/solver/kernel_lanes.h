// SPDX-License-Identifier: BSD-3-Clause
// Kernels of plane and IMU factors work on batches of factors side by side.
#pragma once

namespace vip_slam {

/// Factors per batch; the last batch is padded with copies of any factor.
constexpr int kKernelLanes = 8;

}  // namespace vip_slam
