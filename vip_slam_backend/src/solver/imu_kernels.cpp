// SPDX-License-Identifier: BSD-3-Clause
#include "imu_kernels.h"

#include "instruction_set.h"

namespace vip_slam {

#define KERNEL_BODY "imu_kernels_body.inc"
#define KERNEL_TABLE ImuKernels
#include "kernel_builds.inc"

const ImuKernels& imuKernels(InstructionSet set) { return kernelsOf(set); }

}  // namespace vip_slam
