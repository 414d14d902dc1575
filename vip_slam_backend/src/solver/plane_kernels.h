// Compressed homographies of the structured solver on plain arrays, eight factors at a time.
#pragma once

#include <cstdint>

#include "kernel_lanes.h"
#include "point_kernels.h"

namespace vip_slam {

struct KernelPlane {
  double n[3], d;
  double basis[6];             ///< 3 x 2, row-major
  std::int64_t diagonal;
  std::int32_t unknown;
};

struct KernelHomography {
  std::int32_t i, j, plane;
  bool ji_transposed, pi_transposed, pj_transposed;
  std::int64_t ji, pi, pj;     ///< offsets of the blocks; -1: none
};

struct HomographyKernelArguments {
  const KernelFrame* frames = nullptr;
  const KernelPlane* planes = nullptr;
  const KernelHomography* factors = nullptr;
  const double* sums = nullptr;       ///< HomographySums, [batch][24][kKernelLanes]
  double *values = nullptr, *gradient = nullptr;
};

struct HomographyKernels {
  void (*linearize)(const HomographyKernelArguments& a, int count);
  /// Sum of h^T G h.
  double (*cost)(const HomographyKernelArguments& a, int count);
};

const HomographyKernels& homographyKernels();

}  // namespace vip_slam
