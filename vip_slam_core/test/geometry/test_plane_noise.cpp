// SPDX-License-Identifier: BSD-3-Clause
// Weights of depth points on planes, from their agreement with the planes.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "vip_slam_core/geometry/plane_noise.h"

using namespace vip_slam;

namespace {

constexpr double kSigma = 0.005;
constexpr int kPoints = 50;

// Depth points on the plane z = 2 + offset + slope x, scattered along z, weighted for kSigma.
Eigen::Matrix4d observation(double offset, double slope, double scatter, std::mt19937* random) {
  std::normal_distribution<double> normal;
  Eigen::Matrix4d G = Eigen::Matrix4d::Zero();
  for (int k = 0; k < kPoints; ++k) {
    const double x = 0.2 * (k % 10) - 0.9, y = 0.4 * (k / 10) - 0.8;
    const Eigen::Vector4d p(x, y, 2.0 + offset + slope * x + scatter * normal(*random), 1.0);
    G += p * p.transpose() / (kSigma * kSigma);
  }
  return G;
}

const Eigen::Vector4d kAhead(0, 0, -1, 2);

}  // namespace

TEST(PlaneNoise, MisfitIsDistanceAndTiltWithoutScatter) {
  std::mt19937 random(1);
  EXPECT_NEAR(planeMisfit(observation(0, 0, 0, &random), kAhead), 0, 1e-6);
  const double distance = 0.003;
  EXPECT_NEAR(planeMisfit(observation(distance, 0, 0, &random), kAhead),
              kPoints * distance * distance / (kSigma * kSigma), 1e-6);
  // Tilt: the squared distances along x that the slope makes; the best plane has none left.
  const double slope = 0.01, spread = 0.33;  // mean of x^2
  EXPECT_NEAR(planeMisfit(observation(0, slope, 0, &random), kAhead),
              kPoints * slope * slope * spread / (kSigma * kSigma), 1e-3 * kPoints);
  // Points that scatter by their sigma say little about the plane being wrong: three degrees of freedom, not 50.
  double sum = 0;
  constexpr int kDraws = 300;
  for (int k = 0; k < kDraws; ++k) sum += planeMisfit(observation(0, 0, kSigma, &random), kAhead);
  EXPECT_NEAR(sum / kDraws, 3.0, 0.5);
}

// The information of the shrunk points against that of the dense covariance of all residuals.
TEST(PlaneNoise, SharedErrorsAreMarginalisedExactly) {
  for (const double shared : {0.0, 0.002, 0.01, 0.05}) {
    Eigen::MatrixX4d P(kPoints, 4);
    Eigen::MatrixX3d moves(kPoints, 3);  // of the points along the normal, by the shared errors
    const Eigen::Quaterniond R(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 0.5).normalized()));
    for (int k = 0; k < kPoints; ++k) {
      // A centred grid, uneven in its two directions.
      const double x = 0.2 * (k % 10) - 0.9, y = 0.15 * (k / 10) - 0.3;
      P.row(k).head<3>() = R * Eigen::Vector3d(x, y, 0) + Eigen::Vector3d(0.3, -0.2, 2.5);
      P(k, 3) = 1;
      moves.row(k) << 1, x / std::sqrt(0.33), y / std::sqrt(0.045);  // over the root mean squares
    }
    const Eigen::MatrixXd noise = kSigma * kSigma * Eigen::MatrixXd::Identity(kPoints, kPoints);
    const Eigen::Vector3d variances = shared * shared * Eigen::Vector3d(1, 1 / 3.0, 1 / 3.0);
    const Eigen::MatrixXd covariance = noise + moves * variances.asDiagonal() * moves.transpose();
    const Eigen::Matrix4d dense = P.transpose() * covariance.ldlt().solve(P);
    const Eigen::Matrix4d G = P.transpose() * P / (kSigma * kSigma);
    const Eigen::Matrix4d T = sharedErrorShrinkage(G, shared * shared);
    EXPECT_LT((T * G * T.transpose() - dense).norm(), 1e-6 * dense.norm()) << shared;
    // The same for points one by one, as the uncompressed variant uses them.
    const Eigen::MatrixX4d shrunk = P * T.transpose() / kSigma;
    EXPECT_LT((shrunk.transpose() * shrunk - dense).norm(), 1e-6 * dense.norm()) << shared;
    EXPECT_GT(shrunk.col(3).minCoeff(), 0);
  }
}

TEST(PlaneNoise, ManyCorrelatedReadingsAreNotWorthMany) {
  std::mt19937 random(2);
  const Eigen::Matrix4d G = observation(0, 0, kSigma, &random);
  const double shared = 0.01;
  for (const double readings : {1.0, 100.0, 1e6}) {  // times as many
    const Eigen::Matrix4d T = sharedErrorShrinkage(readings * G, shared * shared);
    const double weight = (readings * T * G * T.transpose())(3, 3);
    EXPECT_NEAR(1 / weight, shared * shared + kSigma * kSigma / (kPoints * readings), 1e-9 / weight) << readings;
  }
  EXPECT_TRUE(sharedErrorShrinkage(Eigen::Matrix4d::Zero(), 1).isIdentity(0));
}

// The two parts are stated in squares of a reading's sigma, along the viewing ray; a wall that is seen at an angle
// moves by less along its normal.
TEST(PlaneNoise, TheTwoPartsGoByTheReadingsSigmaAlongTheNormal) {
  std::mt19937 random(1);
  const Eigen::Matrix4d G = observation(0, 0, 0, &random);
  const DepthNoise model;
  const DepthNoiseParts parts{0.2, 0.7};
  for (const double turned : {0.0, 0.6}) {
    const Eigen::Vector3d n(std::sin(turned), 0, -std::cos(turned));
    const double reading = std::pow(model.sigma(2.0) * std::cos(turned), 2);
    const SurfaceNoise noise = surfaceNoise(G, kPoints, n, model, parts);
    EXPECT_NEAR(noise.shared, 0.7 * reading, 1e-12);
    EXPECT_NEAR(1 / (G / noise.white)(3, 3), 0.2 * reading / kPoints, 1e-12) << "variance of the mean of all";
  }
  const SurfaceNoise nothing = surfaceNoise(Eigen::Matrix4d::Zero(), 0, kAhead.head<3>(), model, parts);
  EXPECT_EQ(nothing.white, 1);
  EXPECT_EQ(nothing.shared, 0);
}

// Misfits of points whose errors are as the model says, shared ones included, are a chi square's.
TEST(PlaneNoise, MisfitsKnowWhatIsShared) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const double shared = 0.008, extent = std::sqrt(0.33);
  double sum = 0;
  constexpr int kDraws = 2000;
  for (int k = 0; k < kDraws; ++k) {
    const Eigen::Matrix4d G =
        observation(shared * normal(random), shared / std::sqrt(3.0) / extent * normal(random), kSigma, &random);
    const Eigen::Matrix4d T = sharedErrorShrinkage(G, shared * shared);
    sum += planeMisfit(T * G * T.transpose(), kAhead);
  }
  // Distance and the turn about y err as said, that about x by the white part alone.
  EXPECT_NEAR(sum / kDraws, 2.0, 0.2);
}

// With poses as good as the points, everything else agrees far better than the noise model expects.
TEST(PlaneNoise, WhatNoiseExplainsMayBeAPlane) {
  for (const double misfit : {1.5, 6.0}) {
    std::vector<PlaneMisfit> misfits(100, PlaneMisfit{0, 0.01, 1e-8});
    misfits.insert(misfits.end(), 10, PlaneMisfit{1, misfit, 4e-4});
    const std::vector<char> agree = planesAgree(misfits, 2);
    EXPECT_TRUE(agree[0]);
    EXPECT_EQ(agree[1] != 0, misfit < 2.0);
  }
}

// A wall that bows by some millimetres disagrees with an exact map, and is one wall.
TEST(PlaneNoise, AnUnevenWallIsAPlane) {
  for (const double off : {0.004, 0.02}) {
    std::vector<PlaneMisfit> misfits(100, PlaneMisfit{0, 0.01, 1e-8});
    misfits.insert(misfits.end(), 10, PlaneMisfit{1, 30, off * off});
    EXPECT_EQ(planesAgree(misfits, 2)[1] != 0, off < 0.01);
  }
}

TEST(PlaneNoise, WhatIsNoPlaneCountsForLess) {
  for (const double unit : {0.2, 1.0, 3.0}) {  // of the sigma; weights are relative to what is typical of the map
    std::mt19937 random(4);
    std::normal_distribution<double> normal(0.0, 0.01 * unit);
    std::vector<PlaneMisfit> misfits;
    for (int k = 0; k < 400; ++k) {
      const int plane = k % 10;
      // Plane 9 is a row of boxes whose fronts lie a centimetre apart (in units), plane 8 had one bad keyframe.
      const double offset = plane == 9 ? normal(random) : plane == 8 && k < 10 ? 0.01 * unit : 0.0;
      misfits.push_back({plane, planeMisfit(observation(offset, 0, unit * kSigma, &random), kAhead), 4e-4});
    }
    const std::vector<double> weights = planeWeights(misfits, 12);
    for (int plane = 0; plane < 8; ++plane) EXPECT_GT(weights[plane], 0.7) << unit << " " << plane;
    EXPECT_GT(weights[8], 0.3);
    EXPECT_LT(weights[9], 0.03);
    EXPECT_EQ(weights[10], 1.0);  // without observations
    const std::vector<char> agree = planesAgree(misfits, 12);
    for (int plane = 0; plane < 12; ++plane) EXPECT_EQ(agree[plane] != 0, plane != 9) << unit << " " << plane;
  }
  EXPECT_EQ(planeWeights({{0, 1000.0}, {0, 1000.0}}, 1)[0], 1.0);  // too few to tell
}
