// SPDX-License-Identifier: BSD-3-Clause
// Rotations, rigid transforms and planes: group properties, and every Jacobian against central differences.
#include <gtest/gtest.h>

#include <random>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/geometry/relative_motion.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/testing/numeric_jacobian.h"

namespace vip_slam {
namespace {

using testing::numericJacobian;

class Geometry : public ::testing::Test {
 protected:
  Eigen::Vector3d vector(double scale) {
    return scale * Eigen::Vector3d(normal_(random_), normal_(random_), normal_(random_));
  }
  SE3 pose() { return SE3(expQuaternion(vector(1.0)), vector(2.0)); }
  Plane plane() { return Plane(vector(1.0), 2.0 * normal_(random_)); }

  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
};

const double kAngles[] = {0, 1e-12, 1e-8, 1e-5, 1e-3, 0.1, 0.299, 0.301, 1.0, 2.5, M_PI - 1e-6, M_PI - 1e-10};

TEST_F(Geometry, HatIsTheCrossProduct) {
  const Eigen::Vector3d a = vector(1), b = vector(1);
  EXPECT_LT((hat(a) * b - a.cross(b)).norm(), 1e-15);
}

TEST_F(Geometry, ExponentialIsARotationAndLogarithmItsInverse) {
  for (const double angle : kAngles) {
    const Eigen::Vector3d theta = angle * vector(1).normalized();
    const Eigen::Matrix3d R = expSO3(theta);
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14) << angle;
    EXPECT_NEAR(R.determinant(), 1, 1e-14);
    EXPECT_LT((expQuaternion(theta).toRotationMatrix() - R).norm(), 1e-14) << angle;
    EXPECT_LT((logSO3(expQuaternion(theta)) - theta).norm(), 1e-14 + 1e-15 * angle) << angle;
    EXPECT_LT((logSO3(R) - theta).norm(), 1e-9) << angle;
    const Eigen::Quaterniond q = expQuaternion(theta);
    EXPECT_EQ(logSO3(q), logSO3(Eigen::Quaterniond(-q.w(), -q.x(), -q.y(), -q.z())));
  }
}

TEST_F(Geometry, LogarithmStaysWithinHalfATurn) {
  for (int k = 0; k < 100; ++k) EXPECT_LE(logSO3(expQuaternion(vector(5))).norm(), M_PI + 1e-12);
}

TEST_F(Geometry, JacobiansOfTheRotationGroup) {
  for (const double angle : kAngles) {
    const Eigen::Vector3d theta = angle * vector(1).normalized();
    const Eigen::Quaterniond q = expQuaternion(theta);
    const Eigen::MatrixXd right = numericJacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return logSO3(q.conjugate() * expQuaternion(theta + d)); },
        3);
    const Eigen::MatrixXd left = numericJacobian(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return logSO3(expQuaternion(theta + d) * q.conjugate()); },
        3);
    EXPECT_LT((rightJacobianSO3(theta) - right).norm(), 1e-8) << angle;
    EXPECT_LT((leftJacobianSO3(theta) - left).norm(), 1e-8) << angle;
    EXPECT_LT((rightJacobianSO3(theta) * rightJacobianInverseSO3(theta) - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_LT((leftJacobianSO3(theta) - rightJacobianSO3(-theta)).norm(), 1e-15);
  }
}

TEST_F(Geometry, JacobiansDoNotJumpWhereTheSeriesTakesOver) {
  const Eigen::Vector3d axis = vector(1).normalized();
  const double below = std::nextafter(0.3, 0.0), above = std::nextafter(0.3, 1.0);
  EXPECT_LT((rightJacobianSO3(below * axis) - rightJacobianSO3(above * axis)).norm(), 1e-14);
  EXPECT_LT((rightJacobianInverseSO3(below * axis) - rightJacobianInverseSO3(above * axis)).norm(), 1e-14);
}

TEST_F(Geometry, LevellingPutsUpUpwardsWithoutYaw) {
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector3d up = vector(9.81);
    const Eigen::Quaterniond R = gravityAlignedRotation(up);
    EXPECT_LT((R * up.normalized() - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
    if (std::abs((R * Eigen::Vector3d::UnitX()).z()) < 0.8) EXPECT_NEAR(yawOf(R), 0, 1e-9);
  }
  const Eigen::Vector3d down(0, 0, -3);  // upside down: the shortest arc is not unique
  EXPECT_LT((gravityAlignedRotation(down) * Eigen::Vector3d(0, 0, -1) - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((rotationBetween({1, 0, 0}, {0, 1, 0}) * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0, 1, 0)).norm(),
            1e-14);
  EXPECT_NEAR(yawOf(expQuaternion({0, 0, 2.5})), 2.5, 1e-14);
}

TEST_F(Geometry, LevellingABodyOnItsEndDoesNotHangOnNoise) {
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Quaterniond exact = gravityAlignedRotation(Eigen::Vector3d(sign * 9.81, 0, 0));
    for (int k = 0; k < 20; ++k) {
      const Eigen::Quaterniond R = gravityAlignedRotation(Eigen::Vector3d(sign * 9.81, 0, 0) + vector(0.05));
      EXPECT_LT(R.angularDistance(exact), 0.03);
    }
  }
}

TEST_F(Geometry, LevelledWorldsAreAlignedHoweverTheBodyIsHeld) {
  for (int k = 0; k < 50; ++k) {
    const SE3 T_A_C(expQuaternion({0, 0, vector(3).x()}), vector(5));
    const SE3 T_C_B(k % 2 ? pose().rotation() : expQuaternion({0, -0.5 * M_PI, 0}), vector(5));
    const SE3 T_A_B = T_A_C * T_C_B;
    EXPECT_LT(alignLevelled(T_A_B, T_C_B).boxminus(T_A_C).norm(), 1e-9);
    // A tilt error turns the two worlds against each other by no more than itself.
    const SE3 tilted(expQuaternion({0.004, -0.003, 0}) * T_A_B.rotation(), T_A_B.t());
    EXPECT_LT(alignLevelled(tilted, T_C_B).rotation().angularDistance(T_A_C.rotation()), 0.001);
  }
}

TEST_F(Geometry, TransformsAreAGroup) {
  const SE3 a = pose(), b = pose();
  const Eigen::Vector3d p = vector(3);
  EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-13);
  EXPECT_LT((a.inverse() * (a * p) - p).norm(), 1e-13);
  EXPECT_LT(((a * b).matrix() - a.matrix() * b.matrix()).norm(), 1e-13);
  EXPECT_LT((SE3(a.matrix()).matrix() - a.matrix()).norm(), 1e-14);
  EXPECT_LT((SE3(a.R(), a.t()).matrix() - a.matrix()).norm(), 1e-14);
  EXPECT_TRUE(a.isFinite());
  EXPECT_FALSE(SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, NAN, 0)).isFinite());
}

TEST_F(Geometry, TransformExponentialLogarithmAdjoint) {
  for (const double angle : kAngles) {
    Vector6d xi;
    xi << angle * vector(1).normalized(), vector(2);
    EXPECT_LT((SE3::exp(xi).log() - xi).norm(), 1e-9) << angle;
    const SE3 T = pose();
    const SE3 left = T * SE3::exp(xi) * T.inverse(), right = SE3::exp(T.adjoint() * xi);
    EXPECT_LT((left.matrix() - right.matrix()).norm(), 1e-11) << angle;
  }
  // The exponential is that of the 4x4 matrix: its derivative along a line is T * hat(xi).
  Vector6d xi;
  xi << vector(0.5), vector(1);
  const Eigen::Matrix4d derivative = (SE3::exp(1.000001 * xi).matrix() - SE3::exp(0.999999 * xi).matrix()) / 2e-6;
  Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
  generator.topLeftCorner<3, 3>() = hat(xi.head<3>());
  generator.topRightCorner<3, 1>() = xi.tail<3>();
  EXPECT_LT((derivative - SE3::exp(xi).matrix() * generator).norm(), 1e-8);
}

TEST_F(Geometry, TransformPerturbation) {
  const SE3 T = pose();
  Vector6d delta;
  delta << vector(0.4), vector(0.4);
  const SE3 moved = T.boxplus(delta);
  EXPECT_LT((moved.boxminus(T) - delta).norm(), 1e-13);
  EXPECT_LT((moved.R() - T.R() * expSO3(delta.head<3>())).norm(), 1e-14);
  EXPECT_LT((moved.t() - T.t() - delta.tail<3>()).norm(), 1e-14);
  const SE3 half = interpolate(T, moved, 0.5);
  EXPECT_LT((half.boxminus(T) - 0.5 * delta).norm(), 1e-13);
  EXPECT_LT(interpolate(T, moved, 0).boxminus(T).norm(), 1e-13);
  EXPECT_LT(interpolate(T, moved, 1).boxminus(moved).norm(), 1e-13);
}

TEST_F(Geometry, MotionsOneAfterTheOther) {
  const auto motion = [&] {
    RelativeMotion m;
    m.T_a_b = pose();
    Matrix6d L = Matrix6d::Zero();
    for (int c = 0; c < 6; ++c) L.block<3, 1>(0, c) = vector(0.01), L.block<3, 1>(3, c) = vector(0.05);
    m.covariance = L * L.transpose() + 1e-6 * Matrix6d::Identity();
    return m;
  };
  const RelativeMotion ab = motion(), bc = motion(), ac = compose(ab, bc);
  EXPECT_TRUE(ab.isUsable() && bc.isUsable() && ac.isUsable());
  EXPECT_LT(ac.T_a_b.boxminus(ab.T_a_b * bc.T_a_b).norm(), 1e-14);
  // J = d(T_ac) / d(T_ab, T_bc) by differences.
  Matrix6d J[2];
  constexpr double h = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const Vector6d d = h * Vector6d::Unit(k);
    J[0].col(k) = (ab.T_a_b.boxplus(d) * bc.T_a_b).boxminus(ab.T_a_b.boxplus(-d) * bc.T_a_b) / (2 * h);
    J[1].col(k) = (ab.T_a_b * bc.T_a_b.boxplus(d)).boxminus(ab.T_a_b * bc.T_a_b.boxplus(-d)) / (2 * h);
  }
  const Matrix6d expected = J[0] * ab.covariance * J[0].transpose() + J[1] * bc.covariance * J[1].transpose();
  EXPECT_LT((ac.covariance - expected).norm(), 1e-8 * expected.norm());

  EXPECT_FALSE(RelativeMotion().known());
  EXPECT_FALSE(compose(RelativeMotion(), bc).known());
  EXPECT_FALSE(compose(ab, RelativeMotion()).known());
  RelativeMotion bad = ab;
  bad.covariance(3, 3) = -1;
  EXPECT_FALSE(bad.isUsable());
  bad = ab;
  bad.covariance(0, 5) += ab.covariance(5, 5);
  EXPECT_FALSE(bad.isUsable());
  bad = ab;
  bad.T_a_b.t().x() = std::nan("");
  EXPECT_FALSE(bad.isUsable());
}

TEST_F(Geometry, PlaneBasics) {
  const Plane p({0, 0, 2}, -3);
  EXPECT_DOUBLE_EQ(p.d, -1.5);
  EXPECT_DOUBLE_EQ(p.signedDistance({5, 5, 2}), 0.5);
  EXPECT_LT((p.project({5, 4, 2}) - Eigen::Vector3d(5, 4, 1.5)).norm(), 1e-15);
  EXPECT_NEAR(Plane::fromPointNormal({1, 2, 3}, {1, 1, 0}).signedDistance({1, 2, 3}), 0, 1e-15);
  EXPECT_EQ(p.flipped().signedDistance({5, 5, 2}), -0.5);
  EXPECT_EQ(p.coefficients(), Eigen::Vector4d(0, 0, 1, -1.5));
  EXPECT_THROW(Plane(Eigen::Vector3d::Zero(), 1), std::invalid_argument);
  EXPECT_NEAR(angleBetween(Plane({1, 0, 0}, 1), Plane({-1, 1, 0}, 2)), M_PI / 4, 1e-14);
  EXPECT_NEAR(angleBetween(Plane({1, 0, 0}, 1), Plane({-1, 1e-9, 0}, 2)), 1e-9, 1e-15);
}

TEST_F(Geometry, ClosestPointVectorAndItsSign) {
  for (int k = 0; k < 50; ++k) {
    const Plane p = plane();
    const Plane back = Plane::fromCp(p.toCp());
    EXPECT_GE(back.d, 0);
    EXPECT_LT((back.coefficients() - (p.d < 0 ? p.flipped() : p).coefficients()).norm(), 1e-12);
    EXPECT_LT((p.toCp() - p.flipped().toCp()).norm(), 1e-15);  // does not depend on the side
    EXPECT_NEAR(p.signedDistance(-p.toCp()), 0, 1e-12);        // eta is minus the closest point
  }
  EXPECT_THROW(Plane::fromCp({0, 0, 1e-10}), std::invalid_argument);
}

TEST_F(Geometry, PlaneManifold) {
  for (int k = 0; k < 50; ++k) {
    const Plane p = plane();
    const Eigen::Matrix<double, 3, 2> B = tangentBasis(p.n);
    EXPECT_LT((B.transpose() * B - Eigen::Matrix2d::Identity()).norm(), 1e-14);
    EXPECT_LT((B.transpose() * p.n).norm(), 1e-14);
    const Eigen::Vector3d delta = vector(0.3);
    const Plane moved = p.boxplus(delta);
    EXPECT_NEAR(moved.n.norm(), 1, 1e-14);
    EXPECT_LT((moved.boxminus(p) - delta).norm(), 1e-12);
    EXPECT_LT(p.boxminus(p).norm(), 1e-15);
    EXPECT_NEAR(angleBetween(p, p.boxplus(Eigen::Vector3d(0.2, 0, 5))), 0.2, 1e-12);
    const Eigen::MatrixXd J =
        numericJacobian([&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return p.boxplus(d).coefficients(); }, 3);
    Eigen::Matrix<double, 4, 3> analytic = Eigen::Matrix<double, 4, 3>::Zero();
    analytic.topLeftCorner<3, 2>() = B;
    analytic(3, 2) = 1;
    EXPECT_LT((J - analytic).norm(), 1e-8);
  }
}

TEST_F(Geometry, PlanesAreCarriedWithTheirPoints) {
  const SE3 T_A_B = pose();
  const Plane in_B = plane();
  const Plane in_A = transformPlane(T_A_B, in_B);
  const Eigen::Vector3d x = vector(3);
  EXPECT_NEAR(in_A.signedDistance(T_A_B * x), in_B.signedDistance(x), 1e-13);
  const Eigen::Vector4d by_matrix = T_A_B.matrix().inverse().transpose() * in_B.coefficients();
  EXPECT_LT((by_matrix - in_A.coefficients()).norm(), 1e-13);
}

}  // namespace
}  // namespace vip_slam
