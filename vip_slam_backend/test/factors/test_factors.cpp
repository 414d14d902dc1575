// SPDX-License-Identifier: BSD-3-Clause
// Every factor: analytic against numeric Jacobians; compressed against uncompressed cost and gradient.
#include <gtest/gtest.h>

#include <random>

#include "factors/depth_ratio.h"
#include "vip_slam_backend/factors/gauge_prior.h"
#include "vip_slam_backend/factors/homography.h"
#include "vip_slam_backend/factors/motion_prior.h"
#include "vip_slam_backend/factors/plane_prior.h"
#include "vip_slam_backend/factors/point_to_plane.h"
#include "vip_slam_backend/factors/pose_plane.h"
#include "vip_slam_backend/factors/relative_pose.h"
#include "vip_slam_backend/factors/reprojection.h"
#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_core/testing/analytic_motion.h"
#include "vip_slam_core/testing/numeric_jacobian.h"

using namespace vip_slam;
using vip_slam::testing::numericJacobian;
using vip_slam::testing::rowError;

namespace {

constexpr double kTolerance = 1e-6;

struct Scene {
  std::mt19937 random{42};
  std::normal_distribution<double> normal;
  double gauss(double s) { return s * normal(random); }
  Eigen::Vector3d gauss3(double s) { return {gauss(s), gauss(s), gauss(s)}; }
  SE3 pose(double rotation = 0.15, double translation = 0.3) {
    return SE3(expQuaternion(gauss3(rotation)), gauss3(translation));
  }
  SE3 T_I_C = SE3(expQuaternion(Eigen::Vector3d(0.2, -0.1, 0.3)), Eigen::Vector3d(0.05, -0.03, 0.1));
  SE3 camera() { return T_I_C * pose(0.3, 0.1); }
  // In front of cameras near the origin looking along z.
  Eigen::Vector3d point() { return Eigen::Vector3d(0, 0, 3) + gauss3(0.4); }
  Plane plane() { return Plane(Eigen::Vector3d(0.2, -0.1, -1) + gauss3(0.15), 3.0 + gauss(0.3)); }
  std::vector<HomographyPair> pairs(const FrameGeometry& i, const FrameGeometry& j, const Plane& plane, int count,
                                    double noise) {
    std::vector<HomographyPair> out;
    while (static_cast<int>(out.size()) < count) {
      const Eigen::Vector2d ray(gauss(0.3), gauss(0.3));
      double rho;
      HomographyPair p;
      if (!depthRatio(i, j, plane, ray, &rho)) continue;
      const Eigen::Vector3d ray3(ray.x(), ray.y(), 1);
      const double z = -(plane.d + plane.n.dot(i.t_W_C)) / (i.R_C_W * plane.n).dot(ray3);
      const Eigen::Vector3d x = i.t_W_C + i.R_C_W.transpose() * (z * ray3);
      const Eigen::Vector3d c = j.R_C_W * (x - j.t_W_C);
      p.xy_i = ray + Eigen::Vector2d(gauss(noise), gauss(noise));
      p.xy_j = c.head<2>() / c.z() + Eigen::Vector2d(gauss(noise), gauss(noise));
      p.weight = 500 / rho;
      out.push_back(p);
    }
    return out;
  }
};

}  // namespace

TEST(Factors, ReprojectionAndDepthJacobians) {
  Scene s;
  for (int k = 0; k < 20; ++k) {
    const SE3 T = s.pose();
    const Eigen::Vector3d p = s.point();
    const Eigen::Vector2d xy(s.gauss(0.1), s.gauss(0.1));
    const auto f = [&](const Eigen::VectorXd& d) {
      const FrameGeometry g(T.boxplus(d.head<6>()), s.T_I_C);
      Eigen::Vector3d r;
      Eigen::Vector2d pixel;
      EXPECT_TRUE(reprojectionResidual(g, p + d.tail<3>(), xy, 500, &pixel));
      r << pixel, depthResidual(g, p + d.tail<3>(), 2.9, 30);
      return Eigen::VectorXd(r);
    };
    const FrameGeometry g(T, s.T_I_C);
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 6> Jx;
    Eigen::Matrix<double, 2, 3> Jp;
    Eigen::Matrix<double, 1, 6> Dx;
    Eigen::Matrix<double, 1, 3> Dp;
    ASSERT_TRUE(reprojectionResidual(g, p, xy, 500, &pixel, &Jx, &Jp));
    depthResidual(g, p, 2.9, 30, &Dx, &Dp);
    Eigen::Matrix<double, 3, 9> J;
    J << Jx, Jp, Dx, Dp;
    EXPECT_LT(rowError(J, numericJacobian(f, 9)), kTolerance);
  }
}

TEST(Factors, HomographyJacobian) {
  Scene s;
  for (int k = 0; k < 20; ++k) {
    const SE3 Ti = s.pose(), Tj = s.pose(), T_I_C_i = s.camera(), T_I_C_j = s.camera();
    const Plane plane = s.plane();
    const auto f = [&](const Eigen::VectorXd& d) {
      return Eigen::VectorXd(homographyVector(FrameGeometry(Ti.boxplus(d.segment<6>(0)), T_I_C_i),
                                              FrameGeometry(Tj.boxplus(d.segment<6>(6)), T_I_C_j),
                                              plane.boxplus(d.segment<3>(12))));
    };
    const Eigen::Matrix<double, 3, 2> basis = tangentBasis(plane.n);
    HomographyJacobian J;
    homographyVector(FrameGeometry(Ti, T_I_C_i), FrameGeometry(Tj, T_I_C_j), plane, &basis, &J);
    EXPECT_LT(rowError(J, numericJacobian(f, 15)), kTolerance);
  }
}

TEST(Factors, HomographyMapsPointsWithTheDepthRatio) {
  Scene s;
  const FrameGeometry i(s.pose(), s.T_I_C), j(s.pose(), s.T_I_C);
  const Plane plane = s.plane();
  const Vector9d h = homographyVector(i, j, plane);
  for (const HomographyPair& p : s.pairs(i, j, plane, 10, 0)) {
    EXPECT_LT((homographyRows(p) * h).norm(), 1e-9);
    double rho;
    ASSERT_TRUE(depthRatio(i, j, plane, p.xy_i, &rho));
    EXPECT_NEAR(h.tail<3>().dot(Eigen::Vector3d(p.xy_i.x(), p.xy_i.y(), 1)), rho, 1e-9);
  }
}

TEST(Factors, HomographyCostIsTheReprojectionCost) {
  Scene s;
  const FrameGeometry i(s.pose(), s.T_I_C), j(s.pose(), s.T_I_C);
  const Plane plane = s.plane();
  const Vector9d h = homographyVector(i, j, plane);
  double algebraic = 0, geometric = 0;
  for (const HomographyPair& p : s.pairs(i, j, plane, 200, 1.0 / 500)) {
    const Eigen::Vector3d m = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(h.data()) *
                              Eigen::Vector3d(p.xy_i.x(), p.xy_i.y(), 1);
    algebraic += (homographyRows(p) * h).squaredNorm();
    geometric += (500 * (m.head<2>() / m.z() - p.xy_j)).squaredNorm();
  }
  EXPECT_NEAR(algebraic, geometric, 0.01 * geometric);
}

TEST(Factors, CompressedHomographyEqualsThePairs) {
  Scene s;
  for (int k = 0; k < 10; ++k) {
    const SE3 Ti = s.pose(), Tj = s.pose();
    const Plane plane = s.plane();
    const auto pairs = s.pairs(FrameGeometry(Ti, s.T_I_C), FrameGeometry(Tj, s.T_I_C), plane, 25, 1.0 / 500);
    HomographySums sums{};
    Matrix9d rows, direct = Matrix9d::Zero();
    for (const HomographyPair& p : pairs) {
      addHomographyPair(p, &sums);
      direct += homographyRows(p).transpose() * homographyRows(p);
    }
    const Matrix9d G = homographyMatrix(sums);
    EXPECT_LT((G - direct).norm(), 1e-12 * direct.norm());
    const int rank = decomposeHomography(G, &rows);
    EXPECT_GE(rank, 8);
    EXPECT_LT((rows.transpose() * rows - G).norm(), 1e-9 * G.norm());
    // At random states, not only where the pairs were made.
    const FrameGeometry i(Ti.boxplus(0.05 * Vector6d::Random()), s.T_I_C),
        j(Tj.boxplus(0.05 * Vector6d::Random()), s.T_I_C);
    const Plane moved = plane.boxplus(0.05 * Eigen::Vector3d::Random());
    const Eigen::Matrix<double, 3, 2> basis = tangentBasis(moved.n);
    HomographyJacobian J;
    const Vector9d h = homographyVector(i, j, moved, &basis, &J);
    double cost = 0;
    Eigen::Matrix<double, 15, 1> gradient = Eigen::Matrix<double, 15, 1>::Zero();
    for (const HomographyPair& p : pairs) {
      const Eigen::Vector2d r = homographyRows(p) * h;
      cost += r.squaredNorm();
      gradient += (homographyRows(p) * J).transpose() * r;
    }
    EXPECT_NEAR((rows * h).squaredNorm(), cost, 1e-9 * cost);
    EXPECT_NEAR(h.dot(G * h), cost, 1e-9 * cost);
    EXPECT_LT(((rows * J).transpose() * (rows * h) - gradient).norm(), 1e-9 * gradient.norm());
    EXPECT_LT((J.transpose() * (G * h) - gradient).norm(), 1e-9 * gradient.norm());
  }
}

TEST(Factors, NoiseFreeHomographyHasRankEight) {
  Scene s;
  const FrameGeometry i(s.pose(), s.T_I_C), j(s.pose(), s.T_I_C);
  HomographySums sums{};
  for (const HomographyPair& p : s.pairs(i, j, s.plane(), 30, 0)) addHomographyPair(p, &sums);
  Matrix9d rows;
  EXPECT_EQ(decomposeHomography(homographyMatrix(sums), &rows), 8);
}

TEST(Factors, WeakHomographiesAreRefused) {
  const SE3 identity;
  const FrameGeometry i(identity, identity),
      j(SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.3, 0, 0)), identity);
  double rho;
  EXPECT_TRUE(depthRatio(i, j, Plane(Eigen::Vector3d(0, 0, -1), 2), Eigen::Vector2d(0, 0), &rho));
  // Point at the camera; ray nearly along it; plane behind.
  EXPECT_FALSE(depthRatio(i, j, Plane(Eigen::Vector3d(0, 0, -1), 0.04), Eigen::Vector2d(0, 0), &rho));
  EXPECT_FALSE(depthRatio(i, j, Plane(Eigen::Vector3d(0, -1, -0.05), 2), Eigen::Vector2d(0, 0), &rho));
  EXPECT_FALSE(depthRatio(i, j, Plane(Eigen::Vector3d(0, 0, -1), -2), Eigen::Vector2d(0, 0), &rho));
}

TEST(Factors, PointToPlaneJacobianAndCompression) {
  Scene s;
  for (int k = 0; k < 20; ++k) {
    const SE3 T = s.pose();
    const Plane plane = s.plane();
    const auto f = [&](const Eigen::VectorXd& d) {
      return Eigen::VectorXd(planeInCamera(FrameGeometry(T.boxplus(d.head<6>()), s.T_I_C), plane.boxplus(d.tail<3>())));
    };
    const FrameGeometry g(T, s.T_I_C);
    const Eigen::Matrix<double, 3, 2> basis = tangentBasis(plane.n);
    PlaneInCameraJacobian J;
    const Eigen::Vector4d u = planeInCamera(g, plane, &basis, &J);
    EXPECT_LT(rowError(J, numericJacobian(f, 9)), kTolerance);
    // u is the plane in the camera frame.
    EXPECT_LT((u - transformPlane((T * s.T_I_C).inverse(), plane).coefficients()).norm(), 1e-12);
    Eigen::Matrix4d G = Eigen::Matrix4d::Zero(), rows;
    double cost = 0;
    Eigen::Matrix<double, 9, 1> gradient = Eigen::Matrix<double, 9, 1>::Zero();
    for (int n = 0; n < 15; ++n) {
      const Eigen::Vector4d p = 80 * s.point().homogeneous();
      G += p * p.transpose();
      cost += std::pow(p.dot(u), 2);
      gradient += J.transpose() * p * p.dot(u);
    }
    EXPECT_EQ(decomposePointToPlane(G, &rows), 4);
    EXPECT_NEAR((rows * u).squaredNorm(), cost, 1e-9 * cost);
    EXPECT_LT(((rows * J).transpose() * (rows * u) - gradient).norm(), 1e-9 * gradient.norm());
  }
}

TEST(Factors, PlanePriorJacobian) {
  Scene s;
  for (const PlaneKind kind : {PlaneKind::kHorizontal, PlaneKind::kVertical, PlaneKind::kGeneral})
    for (int k = 0; k < 20; ++k) {
      const Plane plane(s.gauss3(1), s.gauss(3));
      const auto f = [&](const Eigen::VectorXd& d) {
        return Eigen::VectorXd(planePriorResidual(kind, plane.boxplus(d.head<3>()), 50));
      };
      const Eigen::Matrix<double, 3, 2> basis = tangentBasis(plane.n);
      Eigen::Matrix<double, 2, 3> J;
      planePriorResidual(kind, plane, 50, &basis, &J);
      EXPECT_LT(rowError(J, numericJacobian(f, 3)), kTolerance);
    }
  EXPECT_EQ(planePriorResidual(PlaneKind::kHorizontal, Plane(Eigen::Vector3d(0, 0, 1), 1), 50).norm(), 0);
  EXPECT_EQ(planePriorResidual(PlaneKind::kVertical, Plane(Eigen::Vector3d(0.6, 0.8, 0), 1), 50).norm(), 0);
  EXPECT_NEAR(planePriorResidual(PlaneKind::kVertical, Plane(Eigen::Vector3d(0, 0, 1), 1), 50)(0), 50, 1e-12);
}

// Which way a wall faces, and where it stands, is not for its kind to say.
TEST(Factors, PlanePriorKnowsNoYawAndNoPlace) {
  Scene s;
  for (const PlaneKind kind : {PlaneKind::kHorizontal, PlaneKind::kVertical})
    for (int k = 0; k < 20; ++k) {
      const Plane plane(s.gauss3(1), s.gauss(3));
      const double cost = planePriorResidual(kind, plane, 50).norm();
      const SE3 turn(expQuaternion(Eigen::Vector3d(0, 0, s.gauss(2))), s.gauss3(2));
      EXPECT_NEAR(planePriorResidual(kind, transformPlane(turn, plane), 50).norm(), cost, 1e-9);
      const SE3 tilt(expQuaternion(Eigen::Vector3d(0.3, 0.2, 0)), Eigen::Vector3d::Zero());
      EXPECT_GT(std::abs(planePriorResidual(kind, transformPlane(tilt, plane), 50).norm() - cost), 1e-3);
    }
}

TEST(Factors, GaugeHoldsPositionAndYawOnly) {
  Scene s;
  GaugePrior prior;
  prior.T_W_I = s.pose();
  prior.weight = 10;
  for (const bool tilt : {false, true}) {
    prior.tilt = tilt;
    const SE3 T = prior.T_W_I.boxplus(0.2 * Vector6d::Random());
    const auto f = [&](const Eigen::VectorXd& d) {
      return Eigen::VectorXd(gaugeResidual(prior, T.boxplus(d.head<6>())));
    };
    Matrix6d J;
    gaugeResidual(prior, T, &J);
    EXPECT_LT(rowError(J, numericJacobian(f, 6)), kTolerance);
  }
  prior.tilt = false;
  // Roll and pitch stay free: a rotation about a horizontal axis costs nothing.
  SE3 tilted = prior.T_W_I;
  tilted.setRotation(expQuaternion(Eigen::Vector3d(0.05, -0.08, 0)) * prior.T_W_I.rotation());
  EXPECT_LT(gaugeResidual(prior, tilted).norm(), 1e-12);
}

TEST(Factors, RelativePoseJacobians) {
  Scene s;
  for (int k = 0; k < 20; ++k) {
    const SE3 a = s.pose(0.5, 2), b = s.pose(0.5, 2), m = a.inverse() * b * s.pose(0.1, 0.1);
    const auto f = [&](const Eigen::VectorXd& d) {
      return Eigen::VectorXd(relativePoseResidual(a.boxplus(d.head<6>()), b.boxplus(d.tail<6>()), m));
    };
    Matrix6d Ja, Jb;
    relativePoseResidual(a, b, m, &Ja, &Jb);
    Eigen::Matrix<double, 6, 12> J;
    J << Ja, Jb;
    EXPECT_LT(rowError(J, numericJacobian(f, 12)), kTolerance);
    EXPECT_LT(relativePoseResidual(a, b, a.inverse() * b).norm(), 1e-9);
  }
}

TEST(Factors, PosePlaneJacobians) {
  Scene s;
  for (int k = 0; k < 20; ++k) {
    const SE3 T = s.pose(0.5, 1);
    const Plane plane = s.plane();
    const Plane measured = transformPlane(T.inverse(), plane).boxplus(0.1 * Eigen::Vector3d::Random());
    const auto f = [&](const Eigen::VectorXd& d) {
      return Eigen::VectorXd(posePlaneResidual(T.boxplus(d.head<6>()), plane.boxplus(d.tail<3>()), measured));
    };
    Eigen::Matrix<double, 3, 6> Jx;
    Eigen::Matrix3d Jp;
    posePlaneResidual(T, plane, measured, &Jx, &Jp);
    Eigen::Matrix<double, 3, 9> J;
    J << Jx, Jp;
    EXPECT_LT(rowError(J, numericJacobian(f, 9)), kTolerance);
    EXPECT_LT(posePlaneResidual(T, plane, transformPlane(T.inverse(), plane)).norm(), 1e-12);
  }
}

// Whitened, a row mixes all that follow it; raw, each row has its own unit.
TEST(Factors, ImuJacobians) {
  const vip_slam::testing::AnalyticMotion motion(3);
  const Eigen::Vector3d G = gravityVector();
  Scene s;
  const auto perturbed = [](NavState x, const Eigen::VectorXd& d) {
    x.T_W_I = x.T_W_I.boxplus(d.head<6>());
    x.v_W += d.segment<3>(6);
    x.bias_gyro += d.segment<3>(9);
    x.bias_accel += d.segment<3>(12);
    return x;
  };
  for (int k = 0; k < 20; ++k) {
    const double t_i = 0.3 * k, t_j = t_i + 0.2 + 0.05 * (k % 7);
    const Preintegration p(motion.imu(t_i, t_j, 200), s.gauss3(0.02), s.gauss3(0.1), ImuNoise());
    const auto away = [&] { return Eigen::VectorXd::NullaryExpr(15, [&] { return s.gauss(0.02); }).eval(); };
    const NavState i = perturbed(motion.stateAt(t_i), away()), j = perturbed(motion.stateAt(t_j), away());
    for (const bool whiten : {false, true}) {
      const auto f = [&](const Eigen::VectorXd& d) {
        return Eigen::VectorXd(
            p.residual(perturbed(i, d.head<15>()), perturbed(j, d.tail<15>()), G, nullptr, nullptr, whiten));
      };
      Matrix15d Ji, Jj;
      p.residual(i, j, G, &Ji, &Jj, whiten);
      Eigen::Matrix<double, 15, 30> J;
      J << Ji, Jj;
      EXPECT_LT(rowError(J, numericJacobian(f, 30)), kTolerance) << (whiten ? "whitened" : "raw");
    }
  }
}

TEST(Factors, MotionPriorWeightsAreItsJacobian) {
  MotionPrior prior;
  NavState state;
  const auto f = [&](const Eigen::VectorXd& d) {
    NavState x = state;
    x.v_W += d.head<3>();
    x.bias_gyro += d.segment<3>(3);
    x.bias_accel += d.tail<3>();
    return Eigen::VectorXd(motionPriorResidual(prior, x));
  };
  EXPECT_LT(rowError(motionPriorWeights(prior).asDiagonal().toDenseMatrix(), numericJacobian(f, 9)), kTolerance);
}
