// SPDX-License-Identifier: BSD-3-Clause
#include "point_kernels.h"

#include "instruction_set.h"
#include "vip_slam_backend/factors/reprojection.h"

namespace vip_slam {

#define KERNEL_BODY "point_kernels_body.inc"
#define KERNEL_TABLE PointKernels
#include "kernel_builds.inc"

const PointKernels& pointKernels(InstructionSet set) { return kernelsOf(set); }

}  // namespace vip_slam
