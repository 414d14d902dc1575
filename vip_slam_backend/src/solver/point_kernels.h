// SPDX-License-Identifier: BSD-3-Clause
// The inner loops of the structured solver on plain arrays: all observations of a point are linearised at once, so that
// its Jacobians stay in the first-level cache; the parts needed for its elimination are stored.
#pragma once

#include <cstdint>

#include "instruction_set.h"
#include "vip_slam_backend/solver/ba_problem.h"

namespace vip_slam {

/// A frame for the kernels; matrices row-major.
struct KernelFrame {
  alignas(64) double R_C_W[9];
  double t_W_I[3];
  double offset_C[3];             ///< R_C_I t_I_C: p_C = R_C_W (p - t_W_I) - offset_C
  std::int64_t diagonal = -1;     ///< offset of its diagonal block in the values; -1: fixed
  alignas(64) double turn[3][8];  ///< rows of R_C_I, then zeros
  alignas(64) double move[3][8];  ///< three zeros, rows of -R_C_W, two zeros
  double R_C_I[9];
  double t_W_C[3];
  double lever_C[9];         ///< R_C_I [t_I_C]x
  std::int32_t unknown = 0;  ///< first unknown of the pose
};

/// Least diagonal of J^T J for the damping, so that what nothing measures stays where it is.
constexpr double kMinDiagonal = 1e-6;
/// Per frame: a 6 x 6 block (columns of 8) and a gradient of 6, padded.
constexpr int kFrameSums = 56;

struct PointKernelArguments {
  const KernelFrame* frames = nullptr;
  int frame_count = 0;
  const BaObservation* observations = nullptr;  ///< those of a point in the elimination order of their frames
  const int* first = nullptr;                   ///< first observation of each point; one more than points
  const double* points = nullptr;               ///< 3 per point
  const std::uint32_t* pair_offset = nullptr;   ///< [earlier * frame_count + later]: offset of the block in the values
  double huber = 0, depth_huber = 0;
  double inverse_radius = 0;     ///< damping: max(diag, kMinDiagonal) * inverse_radius
  double* values = nullptr;      ///< reduced matrix, lower blocks; added to
  double* frame_sums = nullptr;  ///< kFrameSums per frame: J^T J and J^T r of the pose; added to
  double* eliminated = nullptr;  ///< 8 per frame: W V^-1 g; added to
  /// Per point: elimination touches blocks whose later observation lies in [later_begin, later_end).
  const int *later_begin = nullptr, *later_end = nullptr;
  double* W = nullptr;               ///< per observation 3 columns of 8: J_pose^T J_point
  double* point_system = nullptr;    ///< per point 6: J_point^T J_point (xx, xy, xz, yy, yz, zz)
  double* point_gradient = nullptr;  ///< per point 3: J_point^T r
  double* point_damping = nullptr;   ///< per point 3: max(diag, kMinDiagonal) * inverse_radius
};

struct PointKernels {
  /// For points [begin, end): linearize() computes the Jacobians, which do not depend on the radius, and returns the
  /// robust cost (not halved); eliminate() eliminates the points with them. A block of the reduced matrix gets its
  /// points in ascending order whatever the ranges, so that the sums are bit-identical.
  double (*linearize)(const PointKernelArguments& a, int begin, int end);
  void (*eliminate)(const PointKernelArguments& a, int begin, int end);
  /// Robust cost (not halved).
  double (*cost)(const PointKernelArguments& a, int begin, int end);
  /// step_p = -V^-1 (g_p + W^T step) per point, and its damping; `step` per unknown.
  void (*backSubstitute)(const PointKernelArguments& a, const double* step, double* point_step, int begin, int end);
};

/// The build for an instruction set that this processor supports.
const PointKernels& pointKernels(InstructionSet set);

}  // namespace vip_slam
