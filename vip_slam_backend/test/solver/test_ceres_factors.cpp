// SPDX-License-Identifier: BSD-3-Clause
// The manifolds and cost functions of the Ceres solver: what Ceres requires of them, against central differences.
#include <gtest/gtest.h>

#include <random>

#include "../../src/solver/ceres_factors.h"
#include "factors/cost_jacobian.h"
#include "vip_slam_core/testing/analytic_motion.h"

using namespace vip_slam;

namespace {

// Random parameter blocks and factors between them.
class Factory {
 public:
  Eigen::VectorXd vector(int size, double sigma) {
    return Eigen::VectorXd::NullaryExpr(size, [&] { return sigma * normal_(random_); });
  }
  SE3 pose(double angle, double distance) { return SE3(expQuaternion(vector(3, angle)), vector(3, distance)); }
  SE3 camera() { return pose(0.3, 0.1); }
  // Before cameras near the origin that look along z.
  Plane plane() { return Plane(Eigen::Vector3d(0.2, -0.1, -1) + vector(3, 0.15), 3 + vector(1, 0.3)(0)); }
  Eigen::Vector3d point() { return Eigen::Vector3d(0, 0, 3) + vector(3, 0.4); }
  HomographyPair pair() {
    HomographyPair pair;
    pair.xy_i = vector(2, 0.3), pair.xy_j = vector(2, 0.3), pair.weight = 350;
    return pair;
  }
  BaObservation observation() {
    BaObservation o;
    o.x = 0.1, o.y = -0.2, o.weight = 500, o.depth = 2.9, o.depth_weight = 30;
    return o;
  }
  BaRelativePose relativePose() {
    BaRelativePose f;
    f.T_i_j = pose(0.2, 0.3);
    const Matrix6d weights = Eigen::Map<const Matrix6d>(vector(36, 100).data());
    f.sqrt_information = weights.triangularView<Eigen::Upper>();
    return f;
  }

  CostBlock block(const SE3& T) {
    Eigen::VectorXd x(7);
    x << T.rotation().coeffs(), T.t();
    return {x, &pose_manifold_};
  }
  CostBlock block(const Plane& plane) { return {plane.coefficients(), &plane_manifold_}; }
  CostBlock block(const NavState& state) {
    Eigen::VectorXd x(9);
    x << state.v_W, state.bias_gyro, state.bias_accel;
    return {x};
  }

 private:
  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
  const PoseManifold pose_manifold_;
  const PlaneManifold plane_manifold_;
};

Eigen::VectorXd minus(const CeresManifold& manifold, const Eigen::VectorXd& y, const Eigen::VectorXd& x) {
  Eigen::VectorXd out(manifold.TangentSize());
  EXPECT_TRUE(manifold.Minus(y.data(), x.data(), out.data()));
  return out;
}

RowMajorMatrix minusJacobian(const CostBlock& block) {
  RowMajorMatrix J(block.tangentSize(), block.x.size());
  EXPECT_TRUE(block.manifold->MinusJacobian(block.x.data(), J.data()));
  return J;
}

// The invariants of ceres/manifold_test_utils.h (which needs gmock) that hold for lifted Jacobians as well. `y` lies
// within half a turn of `x`.
void expectManifold(const CostBlock& x, const Eigen::VectorXd& y, const Eigen::VectorXd& delta) {
  const int size = x.tangentSize();
  EXPECT_LT((x.plus(Eigen::VectorXd::Zero(size)) - x.x).norm(), 1e-12);
  EXPECT_LT(minus(*x.manifold, x.x, x.x).norm(), 1e-12);
  EXPECT_LT((minus(*x.manifold, x.plus(delta), x.x) - delta).norm(), 1e-12);
  EXPECT_LT((x.plus(minus(*x.manifold, y, x.x)) - y).norm(), 1e-12);
  EXPECT_LT((minusJacobian(x) * plusJacobian(x) - RowMajorMatrix::Identity(size, size)).norm(), 1e-12);
}

}  // namespace

TEST(CeresManifolds, Pose) {
  Factory random;
  for (int k = 0; k < 20; ++k) {
    const SE3 T = random.pose(1, 3);
    const CostBlock x = random.block(T);
    const Eigen::VectorXd delta = random.vector(6, 0.5);
    expectManifold(x, x.plus(random.vector(6, 0.7)), delta);
    const SE3 moved = poseOf(x.plus(delta).data());
    EXPECT_LT((moved.R() - T.R() * expSO3(delta.head<3>())).norm(), 1e-12);
    EXPECT_LT((moved.t() - T.t() - delta.tail<3>()).norm(), 1e-12);
  }
}

TEST(CeresManifolds, Plane) {
  Factory random;
  for (int k = 0; k < 20; ++k) {
    const CostBlock x = random.block(Plane(random.vector(3, 1), 2)),
                    y = random.block(Plane(x.x.head<3>() + random.vector(3, 0.5), 3));
    expectManifold(x, y.x, random.vector(3, 0.5));
    const auto plus = [&](const Eigen::VectorXd& delta) { return x.plus(delta); };
    const auto minusX = [&](const Eigen::VectorXd& delta) { return minus(*x.manifold, x.x + delta, x.x); };
    EXPECT_LT((plusJacobian(x) - vip_slam::testing::numericJacobian(plus, 3)).norm(), 1e-8);
    EXPECT_LT((minusJacobian(x) - vip_slam::testing::numericJacobian(minusX, 4)).norm(), 1e-8);
  }
}

TEST(CeresFactors, JacobiansOfPoints) {
  Factory random;
  for (int k = 0; k < 10; ++k) {
    const SE3 T_I_C = random.camera();
    const std::vector<CostBlock> blocks{random.block(random.pose(0.1, 0.2)), {random.point()}};
    const BaObservation o = random.observation();
    for (const auto& make : {+[](const SE3&T, const BaObservation&o) { return makeReprojectionCost(T, o, false); },
                             +[](const SE3&T, const BaObservation&o) { return makeReprojectionCost(T, o, true); },
                             +[](const SE3&T, const BaObservation&o) { return makeDepthCost(T, o); }})
      expectRightJacobians(make(T_I_C, o), blocks);
  }
}

TEST(CeresFactors, JacobiansOfPlanes) {
  Factory random;
  for (int k = 0; k < 10; ++k) {
    const SE3 T_I_C_i = random.camera(), T_I_C_j = random.camera();
    const CostBlock i = random.block(random.pose(0.15, 0.3)), j = random.block(random.pose(0.15, 0.3)),
                    plane = random.block(random.plane());
    HomographySums sums{};
    Eigen::Matrix4d G = Eigen::Matrix4d::Zero();
    for (int n = 0; n < 10; ++n) {
      addHomographyPair(random.pair(), &sums);
      const Eigen::Vector4d p = 80 * random.point().homogeneous();
      G += p * p.transpose();
    }
    expectRightJacobians(makeHomographyCost(T_I_C_i, T_I_C_j, homographyMatrix(sums)), {i, j, plane});
    expectRightJacobians(makeHomographyPairCost(T_I_C_i, T_I_C_j, random.pair()), {i, j, plane});
    expectRightJacobians(makePointToPlaneCost(T_I_C_i, G), {i, plane});
    expectRightJacobians(makePlaneSampleCost(T_I_C_i, random.point(), 80), {i, plane});
    for (const PlaneKind kind : {PlaneKind::kHorizontal, PlaneKind::kVertical, PlaneKind::kGeneral})
      expectRightJacobians(makePlanePriorCost(kind, 50), {plane});
  }
}

TEST(CeresFactors, JacobiansOfPosesAndMotions) {
  Factory random;
  const vip_slam::testing::AnalyticMotion motion(3);
  const auto preintegration = std::make_shared<Preintegration>(
      motion.imu(1.0, 1.5, 200), Eigen::Vector3d(0.01, -0.02, 0.01), Eigen::Vector3d(0.1, 0, -0.1), ImuNoise());
  for (int k = 0; k < 10; ++k) {
    std::vector<CostBlock> states;
    for (const double t : {1.0, 1.5}) {
      NavState state = motion.stateAt(t);
      state.v_W += random.vector(3, 0.02);
      state.bias_gyro += random.vector(3, 0.02);
      state.bias_accel += random.vector(3, 0.02);
      states.push_back(random.block(state.T_W_I.boxplus(random.vector(6, 0.02))));
      states.push_back(random.block(state));
    }
    expectRightJacobians(makeImuCost(preintegration, gravityVector()), states);
    expectRightJacobians(makeRelativePoseCost(random.relativePose()), {states[0], states[2]});
    GaugePrior gauge;
    gauge.T_W_I = random.pose(0.2, 0.5);
    for (const bool tilt : {false, true}) {
      gauge.tilt = tilt;
      expectRightJacobians(makeGaugeCost(gauge), {random.block(gauge.T_W_I.boxplus(random.vector(6, 0.2)))});
    }
    expectRightJacobians(makeMotionPriorCost(MotionPrior()), {states[1]});
  }
}
