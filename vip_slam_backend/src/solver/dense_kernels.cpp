// SPDX-License-Identifier: BSD-3-Clause
#include "dense_kernels.h"

#include "instruction_set.h"
#include "vip_slam_backend/solver/sparse_cholesky.h"

namespace vip_slam {

#define KERNEL_BODY "dense_kernels_body.inc"
#define KERNEL_TABLE DenseKernels
#include "kernel_builds.inc"

const DenseKernels& denseKernels() {
  static const DenseKernels& chosen = kernelsOf(fastestInstructionSet());
  return chosen;
}

const DenseKernels& denseKernels(InstructionSet set) { return kernelsOf(set); }

}  // namespace vip_slam
