// SPDX-License-Identifier: BSD-3-Clause
// Ceres cost functions over the shared factors. Parameter blocks: pose 7 (quaternion x y z w, position), motion 9
// (v, b_g, b_a), plane 4 (n, d), point 3. Pose Jacobians are given in the tangent: the pose manifold lifts by [I; 0],
// so that the first six columns of an ambient Jacobian are the tangent's and nothing is computed twice. Plane Jacobians
// are ambient.
#pragma once

#include <memory>

#include <ceres/ceres.h>

#include "ceres_manifold.h"
#include "vip_slam_backend/solver/ba_problem.h"

namespace vip_slam {

/// Pose: R <- R Exp(dtheta), t <- t + dt on (qx qy qz qw tx ty tz).
class PoseManifold : public CeresManifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

/// Plane on S^2 x R as Plane::boxplus.
class PlaneManifold : public CeresManifold {
 public:
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return 3; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

/// The pose of a parameter block.
inline SE3 poseOf(const double* x) {
  return SE3(Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(x)), Eigen::Vector3d(x[4], x[5], x[6]));
}

/// The plane of a parameter block.
inline Plane planeOf(const double* x) {
  Plane plane;
  plane.n = Eigen::Map<const Eigen::Vector3d>(x);
  plane.d = x[3];
  return plane;
}

ceres::CostFunction* makeReprojectionCost(const SE3& T_I_C, const BaObservation& observation, bool with_depth);
ceres::CostFunction* makeDepthCost(const SE3& T_I_C, const BaObservation& observation);
ceres::CostFunction* makeImuCost(std::shared_ptr<const Preintegration> preintegration, const Eigen::Vector3d& gravity);
ceres::CostFunction* makeHomographyCost(const SE3& T_I_C_i, const SE3& T_I_C_j, const Matrix9d& G);
ceres::CostFunction* makeHomographyPairCost(const SE3& T_I_C_i, const SE3& T_I_C_j, const HomographyPair& pair);
ceres::CostFunction* makePointToPlaneCost(const SE3& T_I_C, const Eigen::Matrix4d& G);
ceres::CostFunction* makePlaneSampleCost(const SE3& T_I_C, const Eigen::Vector3d& p_C, double weight);
ceres::CostFunction* makePlanePriorCost(PlaneKind kind, double weight);
ceres::CostFunction* makeRelativePoseCost(const BaRelativePose& factor);
ceres::CostFunction* makeGaugeCost(const GaugePrior& prior);
ceres::CostFunction* makeMotionPriorCost(const MotionPrior& prior);

}  // namespace vip_slam
