// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/drift_monitor.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace vip_slam::frontend {
namespace {

constexpr double kRate = 30.0, kSigma = 2e-3;  // of images, Hz; of one measurement of a bias, rad/s

/// Biases of three axes that are measured image by image, and the Kalman filter that is right for what it was told.
struct Biases {
  Eigen::Vector3d truth = Eigen::Vector3d::Zero(), estimate = Eigen::Vector3d::Zero();
  double variance = 1e-6;
  double nees = 0;  ///< mean, per axis

  void run(double begin, double end, double drift, double noise, std::mt19937* random, DriftMonitor* monitor,
           DriftMonitor::State state = DriftMonitor::kGyroBias) {
    std::normal_distribution<double> normal;
    const int images = static_cast<int>(std::lround((end - begin) * kRate));
    nees = 0;
    for (int k = 0; k < images; ++k) {
      truth.array() += drift / kRate;
      variance += std::pow(monitor->of(state).density(), 2) / kRate;
      const double gain = variance / (variance + kSigma * kSigma), before = variance;
      const Eigen::Vector3d error(normal(*random), normal(*random), normal(*random));
      const Eigen::Vector3d correction = gain * (truth + noise * kSigma * error - estimate);
      estimate += correction;
      variance *= 1 - gain;
      monitor->add(state, correction, Eigen::Vector3d::Constant(before), Eigen::Vector3d::Constant(variance));
      monitor->endImage(begin + (k + 1) / kRate);
      nees += (estimate - truth).squaredNorm() / (3 * variance * images);
    }
  }
};

DriftMonitor monitorOf(bool adapt = true) {
  ImuNoise noise;
  noise.gyro_random_walk = 2e-5;
  FilterOptions options;
  options.adapt_imu_noise = adapt;
  return DriftMonitor(noise, options);
}

/// In how many of twenty minutes without drift it is seen; `noise`: of the measurements, times what the filter was
/// told.
int falseAlarms(double noise) {
  int alarms = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    DriftMonitor monitor = monitorOf();
    Biases biases;
    biases.run(0, 60, 0, noise, &random, &monitor);
    alarms += monitor.of(DriftMonitor::kGyroBias).drifts();
  }
  return alarms;
}

TEST(DriftMonitor, RightWalksStay) { EXPECT_EQ(falseAlarms(1), 0); }

/// Measurements three times as noisy as told look like no drift: their corrections go to and fro.
TEST(DriftMonitor, NoiseIsNoDrift) { EXPECT_LE(falseAlarms(3), 2); }

/// 0.1 degrees a second more in every second, as of a sensor that is taken from a warm room into the cold.
TEST(DriftMonitor, ABiasThatDriftsIsFollowed) {
  constexpr double kDrift = 1.75e-3;
  double believed = 0, followed = 0, error = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    for (const bool adapt : {false, true}) {
      std::mt19937 random(seed);
      DriftMonitor monitor = monitorOf(adapt);
      Biases biases;
      biases.run(0, 10, 0, 1, &random, &monitor);
      biases.run(10, 13, kDrift, 1, &random, &monitor);
      biases.run(13, 40, kDrift, 1, &random, &monitor);
      (adapt ? followed : believed) += biases.nees / 10;
      if (adapt) error += (biases.estimate - biases.truth).norm() / 10;
      EXPECT_EQ(monitor.of(DriftMonitor::kGyroBias).drifts(), adapt);
    }
  }
  EXPECT_GT(believed, 100);
  EXPECT_LT(followed, 3);
  EXPECT_LT(error, 2 * kSigma);
}

TEST(DriftMonitor, ComesDownWhenTheDriftEnds) {
  std::mt19937 random(1);
  DriftMonitor monitor = monitorOf();
  const RandomWalk& walk = monitor.of(DriftMonitor::kGyroBias);
  Biases biases;
  biases.run(0, 10, 0, 1, &random, &monitor);
  biases.run(10, 20, 1.75e-3, 1, &random, &monitor);
  const double during = walk.density();
  biases.run(20, 50, 0, 1, &random, &monitor);
  EXPECT_GT(walk.factor(), 0.99);
  EXPECT_LT(walk.density(), 0.2 * during);
  monitor.reset();
  EXPECT_EQ(walk.factor(), 1);
  EXPECT_FALSE(walk.drifts());
}

/// Of two states that are corrected in one direction the one that is so more surely drifts; the other may follow it.
TEST(DriftMonitor, RaisesTheSurestOnly) {
  DriftMonitor monitor = monitorOf();
  const Eigen::VectorXd variance = Eigen::Vector3d::Constant(1e-6), less = 0.99 * variance;
  const Eigen::VectorXd one = Eigen::VectorXd::Constant(1, 1e-8), less_of_one = 0.99 * one;
  for (int k = 1; k <= 340 && monitor.of(DriftMonitor::kDelay).density() == 0; ++k) {
    const double drift = k > 300 ? 1.0 : 0.0;
    monitor.add(DriftMonitor::kGyroBias, Eigen::Vector3d::Constant(1e-4 * drift), variance, less);
    monitor.add(DriftMonitor::kDelay, Eigen::VectorXd::Constant(1, 2e-5 * drift), one, less_of_one);
    monitor.endImage(k / kRate);
  }
  EXPECT_GT(monitor.of(DriftMonitor::kDelay).density(), 0);
  EXPECT_EQ(monitor.of(DriftMonitor::kGyroBias).factor(), 1);
}

/// Ten degrees a second more in every second are no bias, but a gyroscope in the wrong unit or axes.
TEST(DriftMonitor, WhatGoesFasterIsNotFollowed) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    std::mt19937 random(seed);
    DriftMonitor monitor = monitorOf();
    Biases biases;
    biases.run(0, 10, 0, 1, &random, &monitor);
    biases.run(10, 20, 0.175, 1, &random, &monitor);
    EXPECT_LT(monitor.of(DriftMonitor::kGyroBias).density(), FilterOptions().sigma_bias_gyro);
  }
}

TEST(DriftMonitor, WhatIsNotFiniteIsLeftOut) {
  DriftMonitor monitor = monitorOf();
  const Eigen::VectorXd variance = Eigen::Vector3d::Constant(1e-6);
  for (int k = 1; k <= 60; ++k) {
    monitor.add(DriftMonitor::kGyroBias, Eigen::Vector3d::Constant(std::nan("")), variance, 0.9 * variance);
    monitor.add(DriftMonitor::kAccelBias, Eigen::Vector3d::Constant(1), variance, 2 * variance);
    monitor.endImage(k / kRate);
  }
  EXPECT_EQ(monitor.of(DriftMonitor::kGyroBias).factor(), 1);
  EXPECT_EQ(monitor.of(DriftMonitor::kAccelBias).factor(), 1);
}

}  // namespace
}  // namespace vip_slam::frontend
