// SPDX-License-Identifier: BSD-3-Clause
// The pose-plane graph's cost functions: yaw and position alone, and the ambient plane.
#include <array>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "../../src/loop/pose_plane_costs.h"
#include "factors/cost_jacobian.h"

namespace vip_slam {
namespace {

class PosePlaneCosts : public ::testing::Test {
 protected:
  Eigen::VectorXd random(int size, double sigma) {
    return Eigen::VectorXd::NullaryExpr(size, [&] { return sigma * normal_(random_); });
  }
  Eigen::Quaterniond rotation() { return expQuaternion(random(3, 1)); }
  CostBlock yawPosition() { return {random(4, 0.5)}; }
  CostBlock block(const Plane& plane) { return {plane.coefficients(), manifold_.get()}; }

 private:
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_;
  const std::unique_ptr<CeresManifold> manifold_{makePlaneManifold()};
};

TEST_F(PosePlaneCosts, RelativePoseJacobians) {
  for (int k = 0; k < 20; ++k) {
    const Eigen::Quaterniond R_i = rotation(), R_j = rotation();
    const CostBlock i = yawPosition(), j = yawPosition();
    RelativePoseEdge edge;
    edge.T_i_j = poseAt(R_i, i.x.data()).inverse() * poseAt(R_j, j.x.data());
    edge.T_i_j = edge.T_i_j.boxplus(random(6, 0.2));
    edge.sqrt_information = Eigen::Map<const Matrix6d>(random(36, 10).data());
    expectRightJacobians(makeEdgeCost(edge, R_i, R_j), {i, j});
  }
}

TEST_F(PosePlaneCosts, PosePlaneJacobians) {
  for (int k = 0; k < 20; ++k) {
    const Eigen::Quaterniond R = rotation();
    const CostBlock i = yawPosition();
    const Plane plane(random(3, 1), 2);
    PosePlaneEdge edge;
    edge.measured_I = transformPlane(poseAt(R, i.x.data()).inverse(), plane).boxplus(random(3, 0.2));
    edge.sqrt_information = Eigen::Map<const Eigen::Matrix3d>(random(9, 10).data());
    expectRightJacobians(makeEdgeCost(edge, R), {i, block(plane)});
  }
}

TEST_F(PosePlaneCosts, YawTurnsAboutTheWorldsVertical) {
  const Eigen::Quaterniond R = rotation();
  const SE3 turned = poseAt(R, std::array<double, 4>{0.4, 1, 2, 3}.data());
  EXPECT_LT((turned.R() - expSO3(Eigen::Vector3d(0, 0, 0.4)) * R.toRotationMatrix()).norm(), 1e-12);
  EXPECT_EQ(turned.t(), Eigen::Vector3d(1, 2, 3));
}

}  // namespace
}  // namespace vip_slam
