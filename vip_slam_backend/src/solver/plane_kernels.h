// Compressed homographies of the structured solver on plain arrays: Jacobian, J^T G J and J^T G h of one factor at a time;
// and the product that IMU factors need.
#pragma once

#include <cstdint>

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
  const double* const* G = nullptr;   ///< 81 per factor, symmetric
  double *values = nullptr, *gradient = nullptr, *full_gradient = nullptr, *diagonal = nullptr;
};

struct HomographyKernels {
  void (*linearize)(const HomographyKernelArguments& a, int begin, int end);
  double (*cost)(const HomographyKernelArguments& a, int begin, int end);
  /// IMU factors: H (30 x 32) = J^T J and g (32) = J^T r with J 15 x 32 row-major, columns 30 and 31 zero.
  void (*gram)(const double* J, const double* r, double* H, double* g);
};

const HomographyKernels& homographyKernels();

}  // namespace vip_slam
