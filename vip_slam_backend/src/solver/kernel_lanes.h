// SPDX-License-Identifier: BSD-3-Clause
// How many numbers the kernels take side by side, whatever the width of the processor's vectors.
#pragma once

namespace vip_slam {

/// Factors per batch (the last one is padded with copies of any factor), and rows or columns per block of a matrix.
constexpr int kKernelLanes = 8;

}  // namespace vip_slam
