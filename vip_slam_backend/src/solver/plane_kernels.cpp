// SPDX-License-Identifier: BSD-3-Clause
#include "plane_kernels.h"

#include "instruction_set.h"

namespace vip_slam {

#define KERNEL_BODY "plane_kernels_body.inc"
#define KERNEL_TABLE HomographyKernels
#include "kernel_builds.inc"

const HomographyKernels& homographyKernels(InstructionSet set) { return kernelsOf(set); }

}  // namespace vip_slam
