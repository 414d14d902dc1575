#include "imu_kernels.h"

#include "instruction_set.h"

namespace vip_slam {

#define KERNEL_BODY "imu_kernels_body.inc"
#define KERNEL_TABLE ImuKernels
#include "kernel_builds.inc"

const ImuKernels& imuKernels() {
  static const ImuKernels& chosen = kernelsOf(fastestInstructionSet());
  return chosen;
}

}  // namespace vip_slam
