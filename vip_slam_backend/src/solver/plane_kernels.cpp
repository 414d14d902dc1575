#include "plane_kernels.h"

#include "instruction_set.h"

namespace vip_slam {

#define KERNEL_BODY "plane_kernels_body.inc"
#define KERNEL_TABLE HomographyKernels
#include "kernel_builds.inc"

const HomographyKernels& homographyKernels() {
  static const HomographyKernels& chosen = kernelsOf(fastestInstructionSet());
  return chosen;
}

}  // namespace vip_slam
