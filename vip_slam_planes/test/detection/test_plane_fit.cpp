// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_planes/detection/plane_fit.h"

namespace vip_slam {
namespace {

std::vector<Eigen::Vector3d> samples(const Plane& plane, double sigma, unsigned seed, int count = 400) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-2, 2);
  std::normal_distribution<double> gauss(0, sigma);
  const auto basis = tangentBasis(plane.n);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    points.push_back(basis * Eigen::Vector2d(u(random), u(random)) - plane.n * (plane.d + gauss(random)));
  }
  return points;
}

TEST(PlaneFit, WallThroughTheOrigin) {
  const Plane truth(Eigen::Vector3d(0.6, 0.8, 0), 0.0);
  const auto points = samples(truth, 0.01, 3);
  Plane plane;
  double rms;
  ASSERT_TRUE(fitPlaneRobust(points, std::vector<double>(points.size(), 1.0), 0.005, PlaneKind::kVertical, truth.n,
                             &plane, &rms));
  EXPECT_NEAR(0, plane.d, 0.002);
  EXPECT_LT(angleBetween(truth, plane), 0.1 * kDegree);
  EXPECT_NEAR(0.01, rms, 0.002);
}

TEST(PlaneFit, KindsKeepTheirNormalsAndSide) {
  for (double d : {-1.3, 0.0, 2.4}) {
    Plane plane;
    PlaneMoments moments;
    for (const auto& p : samples(Plane(Eigen::Vector3d::UnitZ(), d), 0, 1)) moments.add(p, 2.0);
    ASSERT_TRUE(fitPlane(moments, PlaneKind::kHorizontal, -Eigen::Vector3d::UnitZ(), &plane));
    EXPECT_EQ(-1.0, plane.n.z());
    EXPECT_NEAR(-d, plane.d, 1e-12);
    const Plane wall(Eigen::Vector3d(-1, 0.2, 0), d);
    moments = PlaneMoments();
    for (const auto& p : samples(wall, 0, 2)) moments.add(p, 1.0);
    ASSERT_TRUE(fitPlane(moments, PlaneKind::kVertical, wall.n, &plane));
    EXPECT_EQ(0.0, plane.n.z());
    EXPECT_LT((plane.coefficients() - wall.coefficients()).norm(), 1e-9);
    const Plane ramp(Eigen::Vector3d(0.3, 0.2, 0.9), d);
    moments = PlaneMoments();
    for (const auto& p : samples(ramp, 0, 4)) moments.add(p, 1.0);
    ASSERT_TRUE(fitPlane(moments, PlaneKind::kGeneral, ramp.n, &plane));
    EXPECT_LT((plane.coefficients() - ramp.coefficients()).norm(), 1e-9);
  }
}

TEST(PlaneFit, ALeanIsWhatPointsAndPriorSayTogether) {
  const double lean = 0.004;
  const auto sum = [](const Plane& plane, double weight) {
    PlaneMoments moments;
    for (const auto& p : samples(plane, 0, 7)) moments.add(p, weight);
    return moments;
  };
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  for (const PlaneKind kind : {PlaneKind::kHorizontal, PlaneKind::kVertical}) {
    const bool level = kind == PlaneKind::kHorizontal;
    const Eigen::Vector3d n = level ? Eigen::Vector3d(lean, 0, 1) : Eigen::Vector3d(1, 0, lean);
    const Plane truth(n, -1.3);
    Plane plane;
    ASSERT_TRUE(fitLeaningPlane(sum(truth, 1e10), kind, 0.01, n, &plane));
    EXPECT_LT(angleBetween(truth, plane), 1e-6);
    ASSERT_TRUE(fitLeaningPlane(sum(truth, 1.0), kind, 1e-6, n, &plane));
    EXPECT_LT(level ? plane.n.head<2>().norm() : std::abs(plane.n.z()), 1e-6);
    // Points and prior with equal information give the mean. The points' axes are those of their scatter.
    const PlaneMoments unit = sum(truth, 1.0);
    const Eigen::Vector3d mean = unit.centroid(), along = level ? Eigen::Vector3d::UnitX() : z;
    const double spread = along.dot((unit.M.topLeftCorner<3, 3>() - unit.weight() * mean * mean.transpose()) * along);
    ASSERT_TRUE(fitLeaningPlane(sum(truth, 1.0 / (spread * 0.01 * 0.01)), kind, 0.01, -n, &plane));
    EXPECT_LT(plane.n.dot(n), 0) << "the side asked for";
    EXPECT_NEAR(0.5 * lean, std::abs(level ? plane.n.x() : plane.n.z()), 0.05 * lean);
  }
}

TEST(PlaneFit, ThirtyPercentOutliersOnOneSide) {
  const Plane truth(Eigen::Vector3d(0, 1, 0), -3.0);
  auto points = samples(truth, 0.005, 5);
  for (std::size_t i = 0; i < points.size() * 3 / 10; ++i) points[i] += truth.n * 0.12;
  Plane plane;
  ASSERT_TRUE(fitPlaneRobust(points, std::vector<double>(points.size(), 1.0), 0.005, PlaneKind::kVertical, truth.n,
                             &plane, nullptr));
  EXPECT_NEAR(truth.d, plane.d, 0.003);
}

TEST(PlaneFit, MomentsMoveWithTheirPoints) {
  const SE3 T = SE3::exp((Vector6d() << 0.3, -0.2, 0.5, 1, 2, -3).finished());
  PlaneMoments before, after;
  for (const auto& p : samples(Plane(Eigen::Vector3d(1, 2, 3), 0.4), 0.02, 6)) {
    before.add(p, 0.7);
    after.add(T * p, 0.7);
  }
  EXPECT_LT((before.transformed(T).M - after.M).norm(), 1e-9 * after.M.norm());
}

TEST(PlaneFit, AColumnOfPointsDoesNotTellWhichWayItsWallRuns) {
  const double sigma = 0.01, width = 0.6;
  PlaneMoments column, wall;
  for (int i = 0; i < 30; ++i) {
    column.add({3 + sigma * (i % 3 - 1), 1, 0.1 * i}, 1 / (sigma * sigma));
    wall.add({3, 1 + width * (i % 10 / 9.0 - 0.5), 0.1 * i}, 1 / (sigma * sigma));
  }
  EXPECT_GT(normalSigma(column, PlaneKind::kVertical), 0.1);
  // Thirty points, spread over the width: sigma / sqrt(sum x^2).
  double sum = 0;
  for (int i = 0; i < 10; ++i) sum += 3 * std::pow(width * (i / 9.0 - 0.5), 2);
  EXPECT_NEAR(sigma / std::sqrt(sum), normalSigma(wall, PlaneKind::kVertical), 1e-9);
  EXPECT_EQ(0, normalSigma(wall, PlaneKind::kHorizontal));
  EXPECT_TRUE(std::isinf(normalSigma(PlaneMoments(), PlaneKind::kGeneral)));
}

TEST(PlaneFit, RefusesWhatDoesNotDetermineAPlane) {
  Plane plane;
  PlaneMoments moments;
  EXPECT_FALSE(fitPlane(moments, PlaneKind::kGeneral, Eigen::Vector3d::UnitX(), &plane));
  moments.add({1, 2, 3}, 1.0);
  EXPECT_FALSE(fitPlane(moments, PlaneKind::kVertical, Eigen::Vector3d::UnitX(), &plane));
  moments.add({2, 2, 3}, 1.0);
  EXPECT_FALSE(fitPlane(moments, PlaneKind::kGeneral, Eigen::Vector3d::UnitX(), &plane));
}

}  // namespace
}  // namespace vip_slam
