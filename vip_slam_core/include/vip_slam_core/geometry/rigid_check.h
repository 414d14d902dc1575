// SPDX-License-Identifier: BSD-3-Clause
// Matrices that users write or files hold, taken as transforms.
#pragma once

#include <string>

#include <Eigen/Core>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

struct RigidTransform {
  SE3 T;
  std::string problem;  ///< why the matrix is none, with what was found and expected; empty when it is one
  std::string note;     ///< not empty when the rotation had to be made exact, with by how much it was off
};

/// A rotation that was rounded, to two decimals or more, is replaced by the nearest one: off orthonormal by 0.024 at
/// most then, and turned by 0.45 degrees at most (20000 random rotations). What is farther off is a problem.
RigidTransform rigidTransform(const Eigen::Matrix4d& M);

}  // namespace vip_slam
