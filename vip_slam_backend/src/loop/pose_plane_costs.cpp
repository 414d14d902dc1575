// SPDX-License-Identifier: BSD-3-Clause
#include "pose_plane_costs.h"

#include "../solver/ceres_factors.h"
#include "vip_slam_backend/factors/pose_plane.h"
#include "vip_slam_backend/factors/relative_pose.h"

namespace vip_slam {
namespace {

// d(perturbation)/d(yaw, position): Exp(yaw z) R = R Exp(R^T z yaw).
template <int Rows>
Eigen::Matrix<double, Rows, 4> held(const Eigen::Matrix<double, Rows, 6>& J, const SE3& T) {
  Eigen::Matrix<double, Rows, 4> H;
  H.col(0) = J.template leftCols<3>() * (T.rotation().conjugate() * Eigen::Vector3d::UnitZ());
  H.template rightCols<3>() = J.template rightCols<3>();
  return H;
}

template <int Rows>
void store(const Eigen::Matrix<double, Rows, 4>& J, double* out) {
  Eigen::Map<Eigen::Matrix<double, Rows, 4, Eigen::RowMajor>> jacobian(out);
  jacobian = J;
}

class RelativeCost : public ceres::SizedCostFunction<6, 4, 4> {
 public:
  RelativeCost(const RelativePoseEdge& edge, const Eigen::Quaterniond& R_i, const Eigen::Quaterniond& R_j)
      : edge_(edge), R_i_(R_i), R_j_(R_j) {}
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const SE3 T_i = poseAt(R_i_, x[0]), T_j = poseAt(R_j_, x[1]);
    Matrix6d J_i, J_j;
    Eigen::Map<Vector6d> r(residuals);
    r = edge_.sqrt_information * relativePoseResidual(T_i, T_j, edge_.T_i_j, &J_i, &J_j);
    if (jacobians && jacobians[0]) store<6>(edge_.sqrt_information * held<6>(J_i, T_i), jacobians[0]);
    if (jacobians && jacobians[1]) store<6>(edge_.sqrt_information * held<6>(J_j, T_j), jacobians[1]);
    return true;
  }

 private:
  RelativePoseEdge edge_;
  Eigen::Quaterniond R_i_, R_j_;
};

class PosePlaneCost : public ceres::SizedCostFunction<3, 4, 4> {
 public:
  PosePlaneCost(const PosePlaneEdge& edge, const Eigen::Quaterniond& R) : edge_(edge), R_(R) {}
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const SE3 T = poseAt(R_, x[0]);
    const Plane plane(Eigen::Vector3d(x[1][0], x[1][1], x[1][2]), x[1][3]);
    Eigen::Matrix<double, 3, 6> J_pose;
    Eigen::Matrix3d J_plane;
    Eigen::Map<Eigen::Vector3d> r(residuals);
    r = edge_.sqrt_information * posePlaneResidual(T, plane, edge_.measured_I, &J_pose, &J_plane);
    if (jacobians && jacobians[0]) store<3>(edge_.sqrt_information * held<3>(J_pose, T), jacobians[0]);
    if (jacobians && jacobians[1]) {
      // From the factor's tangent basis to the ambient (n, d), which the manifold projects to its own tangent.
      Eigen::Matrix<double, 3, 4> to_tangent = Eigen::Matrix<double, 3, 4>::Zero();
      to_tangent.topLeftCorner<2, 3>() = tangentBasis(plane.n).transpose();
      to_tangent(2, 3) = 1;
      store<3>(edge_.sqrt_information * J_plane * to_tangent, jacobians[1]);
    }
    return true;
  }

 private:
  PosePlaneEdge edge_;
  Eigen::Quaterniond R_;
};

}  // namespace

SE3 poseAt(const Eigen::Quaterniond& R, const double* x) {
  return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(x[0], Eigen::Vector3d::UnitZ())) * R,
             Eigen::Vector3d(x[1], x[2], x[3]));
}

ceres::CostFunction* makeEdgeCost(const RelativePoseEdge& edge, const Eigen::Quaterniond& R_i,
                                  const Eigen::Quaterniond& R_j) {
  return new RelativeCost(edge, R_i, R_j);
}
ceres::CostFunction* makeEdgeCost(const PosePlaneEdge& edge, const Eigen::Quaterniond& R) {
  return new PosePlaneCost(edge, R);
}

CeresManifold* makePlaneManifold() {
#if VIP_SLAM_CERES_MANIFOLDS
  return new ceres::ProductManifold<ceres::SphereManifold<3>, ceres::EuclideanManifold<1>>;
#else
  return new PlaneManifold;
#endif
}

}  // namespace vip_slam
