// SPDX-License-Identifier: BSD-3-Clause
// A keyframe's pose unpacked for the visual factors: computed once per keyframe and iteration, used by all its factors.
// Perturbation everywhere: R_W_I <- R_W_I Exp(dtheta), t_W_I <- t_W_I + dt; tangent order (theta, t).
#pragma once

#include <Eigen/Core>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

struct FrameGeometry {
  Eigen::Matrix3d R_W_I = Eigen::Matrix3d::Identity(), R_C_W = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d R_C_I = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t_W_I = Eigen::Vector3d::Zero(), t_I_C = Eigen::Vector3d::Zero(), t_W_C = Eigen::Vector3d::Zero();

  FrameGeometry() = default;
  FrameGeometry(const SE3& T_W_I, const SE3& T_I_C)
      : R_W_I(T_W_I.R()), R_C_I(T_I_C.R().transpose()), t_W_I(T_W_I.t()), t_I_C(T_I_C.t()) {
    R_C_W = R_C_I * R_W_I.transpose();
    t_W_C = t_W_I + R_W_I * t_I_C;
  }
};

}  // namespace vip_slam
