// The hot loop of the structured solver on plain arrays: linearises all observations of a point and eliminates the point
// at once, so that its Jacobians never leave the first-level cache.
#pragma once

#include <cstdint>

#include "vip_slam_backend/solver/ba_problem.h"

namespace vip_slam {

/// A frame for the kernels; matrices row-major.
struct KernelFrame {
  double R_C_W[9], R_C_I[9], R_W_I[9];
  double t_W_I[3], t_W_C[3], t_I_C[3];
  double offset_C[3];          ///< R_C_I t_I_C: p_C = R_C_W (p - t_W_I) - offset_C
  std::int64_t diagonal = -1;  ///< offset of its diagonal block in the values; -1: fixed
  std::int32_t unknown = 0;    ///< first unknown of the pose
};

struct PointKernelArguments {
  const KernelFrame* frames = nullptr;
  int frame_count = 0;
  const BaObservation* observations = nullptr;  ///< those of a point in the elimination order of their frames
  const int* first = nullptr;                   ///< first observation of each point; one more than points
  const double* points = nullptr;               ///< 3 per point
  const std::uint32_t* pair_offset = nullptr;   ///< [earlier * frame_count + later]: offset of the block in the values
  double huber = 0, depth_huber = 0;
  double inverse_radius = 0;                    ///< damping: clamp(diag) * inverse_radius
  double* values = nullptr;                     ///< reduced matrix, lower blocks; added to
  double* gradient = nullptr;                   ///< reduced J^T r per unknown; added to
  double* full_gradient = nullptr;              ///< J^T r before elimination; added to
  double* diagonal = nullptr;                   ///< diag(J^T J) per unknown, before elimination; added to
  double* W = nullptr;                          ///< per observation 3 columns of 8: J_pose^T J_point
  double* point_inverse = nullptr;              ///< per point 6: damped inverse (xx, xy, xz, yy, yz, zz)
  double* point_gradient = nullptr;             ///< per point 3: J_point^T r
  double* point_damping = nullptr;              ///< per point 3: clamp(diag) * inverse_radius
};

struct PointKernels {
  const char* name;
  /// Points [begin, end). `scratch`: 64 doubles per observation of the longest point.
  void (*linearize)(const PointKernelArguments& a, int begin, int end, double* scratch);
  /// Robust cost (not halved).
  double (*cost)(const PointKernelArguments& a, int begin, int end);
  /// step_p = -V^-1 (g_p + W^T step) per point; `step` per unknown. Returns nothing else.
  void (*backSubstitute)(const PointKernelArguments& a, const double* step, double* point_step, int begin, int end);
};

const PointKernels& pointKernels();

}  // namespace vip_slam
