// SPDX-License-Identifier: BSD-3-Clause
#include "instruction_set.h"
#include "plane_kernels.h"

namespace vip_slam {

#define KERNEL_BODY "point_to_plane_body.inc"
#define KERNEL_TABLE PointToPlaneKernels
#include "kernel_builds.inc"

const PointToPlaneKernels& pointToPlaneKernels(InstructionSet set) { return kernelsOf(set); }

}  // namespace vip_slam
