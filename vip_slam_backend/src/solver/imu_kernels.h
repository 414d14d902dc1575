// SPDX-License-Identifier: BSD-3-Clause
// IMU factors of the structured solver on plain arrays, eight factors at a time.
#pragma once

#include <cstdint>

#include "instruction_set.h"
#include "kernel_lanes.h"

namespace vip_slam {

/// Rows of a factor's constants from its preintegration: the information matrix (lower triangle, row by row, order
/// theta, p, v, b_g, b_a), the increments' derivatives by the biases (3 x 3, row-major), the time between the frames,
/// the increments (rotation as x, y, z, w) and the biases at which they were integrated.
constexpr int kImuInformation = 0, kImuAlphaBg = 120, kImuAlphaBa = 129, kImuBetaBg = 138, kImuBetaBa = 147,
              kImuDt = 156, kImuThetaByGyro = 157, kImuAlpha = 166, kImuBeta = 169, kImuDeltaQ = 172,
              kImuBiasGyro = 176, kImuBiasAccel = 179, kImuConstantRows = 182;
/// Offsets in a frame's state: R_W_I (row-major), the same as x, y, z, w, position, velocity, biases.
constexpr int kImuStateR = 0, kImuStateQ = 9, kImuStateP = 13, kImuStateV = 16, kImuStateBiasGyro = 19,
              kImuStateBiasAccel = 22, kImuStateNumbers = 25;
/// Rows of a factor's values that depend on the states: R_W_I of frame i, R_j_i, position and velocity increments in
/// frame i, the residual (15); and, for the Jacobians, the inverse right Jacobian of the rotation's residual and the
/// derivative by b_g of the rotation before it.
constexpr int kImuR = 0, kImuRji = 9, kImuPosition = 18, kImuVelocity = 21, kImuResidual = 24, kImuInverseJr = 39,
              kImuThetaBg = 48, kImuStateRows = 57;

/// Where a factor's blocks go. Nodes: pose i, motion i, pose j, motion j; -1 where one is a constant.
struct KernelImu {
  std::int32_t i, j;  ///< frames
  std::int64_t diagonal[4];
  std::int32_t unknown[4];
  struct Place {
    std::int64_t offset;
    bool transposed;
  } motion_pose_i, motion_pose_j, pose_pose, pose_motion, motion_pose, motion_motion;  ///< the last four: (j, i)
};

struct ImuKernelArguments {
  const KernelImu* factors = nullptr;
  const double* constants = nullptr;  ///< [batch][kImuConstantRows][kKernelLanes]
  double* states = nullptr;           ///< [batch][kImuStateRows][kKernelLanes]
  const double* frames = nullptr;     ///< kImuStateNumbers per frame
  double gravity[3] = {};
  double *values = nullptr, *gradient = nullptr;
};

struct ImuKernels {
  /// Fills the states of `count` factors, except for the rows that only the Jacobians need.
  void (*load)(const ImuKernelArguments& a, int count);
  /// Adds J^T J and J^T r of `count` factors; returns the sum of r^T r.
  double (*linearize)(const ImuKernelArguments& a, int count);
  /// Sum of r^T r, whitened.
  double (*cost)(const ImuKernelArguments& a, int count);
};

/// The build for an instruction set that this processor supports.
const ImuKernels& imuKernels(InstructionSet set);

}  // namespace vip_slam
