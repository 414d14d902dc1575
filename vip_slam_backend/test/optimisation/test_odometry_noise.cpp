// SPDX-License-Identifier: BSD-3-Clause
// The variance component of the odometry: what its covariance lacks is found, whatever it is, from motions whose errors
// are drawn; what is no evidence changes nothing.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "../../src/optimisation/odometry_noise.h"

using namespace vip_slam;
using backend::OdometryNoise;

namespace {

constexpr double kStart = 4;

/// A map that is true, and an odometry whose motions err by `sigmas` of the sigmas that it gives them.
struct DrawnOdometry {
  Map map;
  OdometryNoise noise;
  KeyframeId id = 0;
  double t = 100;
  SE3 T_W_I;
  std::mt19937 random{7};

  void step(double sigmas, double seconds = 0.2, bool known = true) {
    std::normal_distribution<double> normal;
    const SE3 motion(expQuaternion(Eigen::Vector3d(0.02, 0.2 * normal(random), 0.05)), Eigen::Vector3d(0.05, 0, 0.1));
    Keyframe keyframe;
    keyframe.previous = id++;
    keyframe.id = id;
    keyframe.frame.t = t += seconds;
    keyframe.frame.status.state = TrackingState::kTracking;
    const Vector6d sigma = (Vector6d() << 1e-3, 2e-3, 1e-3, 3e-3, 4e-3, 3e-3).finished();
    if (id > 1 && known) {
      Vector6d error;
      for (double& e : error) e = sigmas * normal(random);
      error.array() *= sigma.array();
      keyframe.motion.T_a_b = motion.boxplus(error);
      keyframe.motion.covariance = sigma.cwiseAbs2().asDiagonal();
    }
    if (id > 1) T_W_I = T_W_I * motion;
    NavState state;
    state.t = t;
    state.T_W_I = T_W_I;
    map.addKeyframe(std::make_shared<Keyframe>(keyframe), state, ImuNoise());
    noise.compare(map, id);
  }

  /// Mean of the factor over steps, after as many without looking.
  double settled(double sigmas, int steps = 300) {
    for (int k = 0; k < steps; ++k) step(sigmas);
    double sum = 0;
    for (int k = 0; k < steps; ++k) {
      step(sigmas);
      sum += noise.varianceFactor();
    }
    return sum / steps;
  }
};

}  // namespace

TEST(OdometryNoise, WhatTheCovarianceLacksIsFound) {
  DrawnOdometry odometry;
  EXPECT_EQ(odometry.noise.varianceFactor(), kStart);
  EXPECT_NEAR(odometry.settled(3), 9, 1);
  EXPECT_NEAR(odometry.settled(1.5), 2.25, 0.3);  // and goes down as well
  EXPECT_NEAR(odometry.settled(5), 25, 3);
}

TEST(OdometryNoise, NoCovarianceIsTakenForTooLarge) {
  DrawnOdometry odometry;
  odometry.settled(0.2);
  EXPECT_EQ(odometry.noise.varianceFactor(), 1.0);
}

TEST(OdometryNoise, MotionsThatAreNotKnownOrTakeTooLongAreNoEvidence) {
  DrawnOdometry unknown, slow;
  for (int k = 0; k < 50; ++k) unknown.step(5, 0.2, false);
  for (int k = 0; k < 50; ++k) slow.step(5, 2.5);
  EXPECT_EQ(unknown.noise.varianceFactor(), kStart);
  EXPECT_EQ(slow.noise.varianceFactor(), kStart);
}

TEST(OdometryNoise, TheNewestSecondIsNotJudgedYetAndNothingTwice) {
  DrawnOdometry odometry;
  for (int k = 0; k < 8; ++k) odometry.step(5);  // 1.4 s: none has half a second before and a second behind it
  EXPECT_EQ(odometry.noise.varianceFactor(), kStart);
  for (int k = 0; k < 10; ++k) odometry.step(5);
  const double after = odometry.noise.varianceFactor();
  EXPECT_NE(after, kStart);
  odometry.noise.compare(odometry.map, odometry.id);
  EXPECT_EQ(odometry.noise.varianceFactor(), after);
  odometry.noise.reset();
  EXPECT_EQ(odometry.noise.varianceFactor(), kStart);
}

// A loop that moves a keyframe by a metre against those around it, as none should.
TEST(OdometryNoise, OneTornPlaceIsNotTheNoiseOfAll) {
  DrawnOdometry odometry;
  odometry.settled(1);
  const double before = odometry.noise.varianceFactor();
  odometry.T_W_I = odometry.T_W_I * SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
  for (int k = 0; k < 20; ++k) odometry.step(1);
  EXPECT_LT(odometry.noise.varianceFactor(), 2 * before);
}
