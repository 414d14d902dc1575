// Compressed homographies of the structured solver on plain arrays, eight factors at a time; and the product that IMU
// factors need.
#pragma once

#include <cstdint>

#include "point_kernels.h"

namespace vip_slam {

/// Factors of one batch; the last batch is filled up with copies of any factor.
constexpr int kHomographyLanes = 8;

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
  const double* sums = nullptr;       ///< HomographySums, [batch][24][kHomographyLanes]
  double *values = nullptr, *gradient = nullptr;
};

struct HomographyKernels {
  void (*linearize)(const HomographyKernelArguments& a, int count);
  /// Sum of h^T G h.
  double (*cost)(const HomographyKernelArguments& a, int count);
  /// IMU factors: H (30 x 32, only its upper half) = (W J)^T W J and g (32) = (W J)^T W r with J 15 x 32 row-major,
  /// columns 30 and 31 zero, and W upper-triangular 15 x 15 column-major. `r` is W r already.
  void (*gram)(const double* W, const double* J, const double* r, double* H, double* g);
};

const HomographyKernels& homographyKernels();

}  // namespace vip_slam
