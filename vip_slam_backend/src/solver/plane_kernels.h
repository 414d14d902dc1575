// SPDX-License-Identifier: BSD-3-Clause
// Compressed plane factors of the structured solver on plain arrays, eight factors at a time.
#pragma once

#include <cstdint>

#include "instruction_set.h"
#include "kernel_lanes.h"
#include "point_kernels.h"

namespace vip_slam {

struct KernelPlane {
  double n[3], d;
  double basis[6];  ///< 3 x 2, row-major
  std::int64_t diagonal;
  std::int32_t unknown;
};

struct KernelHomography {
  std::int32_t i, j, plane;
  bool ji_transposed, pi_transposed, pj_transposed;
  std::int64_t ji, pi, pj;  ///< offsets of the blocks; -1: none
};

struct HomographyKernelArguments {
  const KernelFrame* frames = nullptr;
  const KernelPlane* planes = nullptr;
  const KernelHomography* factors = nullptr;
  bool shared_extrinsics = false;  ///< all frames have the same T_I_C
  const double* sums = nullptr;    ///< HomographySums, [batch][24][kKernelLanes]
  double *values = nullptr, *gradient = nullptr;
};

struct HomographyKernels {
  /// Adds J^T G J and J^T G h of `count` factors; returns the sum of h^T G h.
  double (*linearize)(const HomographyKernelArguments& a, int count);
  /// Sum of h^T G h.
  double (*cost)(const HomographyKernelArguments& a, int count);
};

/// The build for an instruction set that this processor supports.
const HomographyKernels& homographyKernels(InstructionSet set);

struct KernelPointToPlane {
  std::int32_t frame, plane;
  bool transposed;
  std::int64_t place;  ///< offset of the block (plane, pose); -1: none
};

struct PointToPlaneKernelArguments {
  const KernelFrame* frames = nullptr;
  const KernelPlane* planes = nullptr;
  const KernelPointToPlane* factors = nullptr;
  bool shared_extrinsics = false;  ///< all frames have the same T_I_C
  const double* sums = nullptr;    ///< G as [batch][10][kKernelLanes]: its 3 x 3 (upper triangle by rows), g, s
  double *values = nullptr, *gradient = nullptr;
};

struct PointToPlaneKernels {
  /// Adds J^T G J and J^T G u of `count` factors; returns the sum of u^T G u.
  double (*linearize)(const PointToPlaneKernelArguments& a, int count);
};

const PointToPlaneKernels& pointToPlaneKernels(InstructionSet set);

}  // namespace vip_slam
