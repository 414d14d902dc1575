// SPDX-License-Identifier: BSD-3-Clause
// Scale of the map from the accelerometer: estimated with a consistent sigma when the motion makes it observable,
// otherwise unknown.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/optimisation/inertial_scale.h"

using namespace vip_slam;

namespace {

struct Walk {
  double map_scale = 1;  ///< map's distance over the true one
  double swing = 0.25;   ///< of the body to and fro, m; accelerations of up to 0.6 m/s^2
  double seconds = 40;
  double jump_at = 1e9;    ///< s; here the map is shifted and the IMU is missing for one interval
  double gravity = 9.81;   ///< of the place
  double accel_scale = 1;  ///< of the accelerometer
  unsigned seed = 1;
};

ImuNoise imuNoise() {
  ImuNoise noise;
  noise.gyro_noise_density = 2e-4;
  noise.gyro_random_walk = 2e-5;
  noise.accel_noise_density = 2e-3;
  noise.accel_random_walk = 1e-3;
  return noise;
}

Eigen::Vector3d place(const Walk& w, double t) {
  return {0.6 * w.swing * t + w.swing * std::sin(1.5 * t), w.swing * std::sin(1.1 * t + 1),
          0.4 * w.swing * std::sin(1.9 * t + 2)};
}

Eigen::Vector3d velocity(const Walk& w, double t) {
  return {0.6 * w.swing + w.swing * 1.5 * std::cos(1.5 * t), w.swing * 1.1 * std::cos(1.1 * t + 1),
          0.4 * w.swing * 1.9 * std::cos(1.9 * t + 2)};
}

Eigen::Vector3d acceleration(const Walk& w, double t) {
  return {-w.swing * 1.5 * 1.5 * std::sin(1.5 * t), -w.swing * 1.1 * 1.1 * std::sin(1.1 * t + 1),
          -0.4 * w.swing * 1.9 * 1.9 * std::sin(1.9 * t + 2)};
}

// Rotation about an axis that stays in the body and in the world: the rate is exact.
const Eigen::Vector3d kAxis = Eigen::Vector3d(0.3, -0.2, 1.0).normalized();
double angle(double t) { return 0.6 * std::sin(0.7 * t); }
double rate(double t) { return 0.6 * 0.7 * std::cos(0.7 * t); }

Map walk(const Walk& w) {
  const ImuNoise noise = imuNoise();
  const double imu_rate = 200, interval = 0.4;
  std::mt19937 random(w.seed);
  std::normal_distribution<double> normal;
  const auto noisy = [&](double sigma) {
    return Eigen::Vector3d(sigma * Eigen::Vector3d::NullaryExpr([&] { return normal(random); }));
  };
  Eigen::Vector3d bias(0.05, -0.03, 0.08);
  Map map;
  std::vector<ImuSample> samples;
  KeyframeId id = 0;
  bool jumped = false;
  const int steps = static_cast<int>(std::lround(interval * imu_rate));
  for (int k = 0; k * interval < w.seconds; ++k) {
    const double t = k * interval;
    const bool jump = !jumped && t >= w.jump_at;
    jumped = jumped || jump;
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = ++id;
    keyframe->frame.t = t;
    if (id > 1 && !jump) {
      keyframe->previous = id - 1;
      keyframe->imu = samples;
    }
    NavState state;
    state.t = t;
    const Eigen::Vector3d shift = jumped ? Eigen::Vector3d(3, -2, 1) : Eigen::Vector3d::Zero();
    state.T_W_I =
        SE3(expQuaternion(Eigen::Vector3d(angle(t) * kAxis)), Eigen::Vector3d(w.map_scale * place(w, t) + shift));
    state.v_W = w.map_scale * velocity(w, t);
    state.bias_accel = bias;
    keyframe->frame.state = state;
    map.addKeyframe(keyframe, state, noise);
    samples.clear();
    for (int i = 0; i <= steps; ++i) {
      const double s = t + i / imu_rate;
      const Eigen::Matrix3d R = expSO3(Eigen::Vector3d(angle(s) * kAxis));
      ImuSample sample;
      sample.t = s;
      sample.gyro = rate(s) * kAxis + noisy(noise.gyro_noise_density * std::sqrt(imu_rate));
      sample.accel = w.accel_scale * (R.transpose() * (acceleration(w, s) + gravityVector(w.gravity))) + bias +
                     noisy(noise.accel_noise_density * std::sqrt(imu_rate));
      bias += noisy(noise.accel_random_walk / std::sqrt(imu_rate));
      samples.push_back(sample);
    }
  }
  EXPECT_EQ(checkMap(map), "");
  return map;
}

InertialScale scaleOf(const Walk& w) { return inertialScale(walk(w), 9.81, imuNoise()); }

}  // namespace

TEST(InertialScale, FindsAMapThatIsTooLargeOrTooSmall) {
  for (const double map_scale : {1.012, 0.988}) {
    Walk w;
    w.map_scale = map_scale;
    const InertialScale scale = scaleOf(w);
    ASSERT_GT(scale.sigma, 0);
    EXPECT_LT(scale.sigma, 0.0025);
    EXPECT_NEAR(scale.factor, 1 / map_scale, 4 * scale.sigma) << map_scale;
  }
}

TEST(InertialScale, ItsSigmaIsHonest) {
  double squares = 0;
  const int runs = 20;
  for (int seed = 1; seed <= runs; ++seed) {
    Walk w;
    w.seed = static_cast<unsigned>(seed);
    const InertialScale scale = scaleOf(w);
    squares += std::pow((scale.factor - 1) / scale.sigma, 2);
    EXPECT_EQ(scaleDifference(scale, SensorConfig()), "");
  }
  EXPECT_LT(squares / runs, 1.8);
  EXPECT_GT(squares / runs, 0.2);
}

TEST(InertialScale, ChainsWithoutImuBetweenThemCountTogether) {
  Walk w;
  w.map_scale = 1.012;
  w.jump_at = 20;
  const InertialScale broken = scaleOf(w);
  w.jump_at = 1e9;
  const InertialScale whole = scaleOf(w);
  EXPECT_NEAR(broken.factor, 1 / 1.012, 4 * broken.sigma);
  EXPECT_LT(broken.sigma, 1.2 * whole.sigma);
}

TEST(InertialScale, GravityOfThePlaceIsNoScale) {
  Walk w;
  w.gravity = 9.83;
  const InertialScale scale = scaleOf(w);
  EXPECT_NEAR(scale.factor, 1, 4 * scale.sigma);
}

// As after a blow: one keyframe lies where it is not.
TEST(InertialScale, WhatOneIntervalDecidesIsNotSure) {
  for (const unsigned seed : {1, 2, 3, 4, 5, 6}) {
    Walk w;
    w.seconds = 8;
    w.swing = 0.2;
    w.seed = seed;
    Map map = walk(w);
    const KeyframeId wrong = 7;
    NavState state = map.keyframe(wrong).state;
    state.T_W_I = SE3(state.T_W_I.rotation(), Eigen::Vector3d(state.T_W_I.t() + Eigen::Vector3d(0.02, 0.02, 0)));
    map.moveKeyframes({{wrong, state.T_W_I}});
    const InertialScale scale = inertialScale(map, 9.81, imuNoise());
    EXPECT_GT(std::abs(scale.factor - 1), 0.05);
    EXPECT_LT(std::abs(scale.factor - 1), 2 * scale.sigma) << scale.factor;
    EXPECT_EQ(scaleDifference(scale, SensorConfig()), "");
  }
}

TEST(InertialScale, NothingIsKnownWithoutMotion) {
  Walk still;
  still.swing = 0;
  EXPECT_EQ(scaleOf(still).sigma, 0);
  EXPECT_EQ(inertialScale(Map(), 9.81, imuNoise()).sigma, 0);
}

TEST(InertialScale, SaysNothingUnlessSureAndLargeEnough) {
  EXPECT_EQ(scaleDifference({0.9, 0.035}, SensorConfig()), "");    // less than three sigmas
  EXPECT_EQ(scaleDifference({0.96, 0.0002}, SensorConfig()), "");  // many, but what a camera's calibration is off by
  EXPECT_EQ(scaleDifference({0.8, 0}, SensorConfig()), "");        // sigma zero: not known
  // A wrong unit is named, without a number to enter.
  const std::string unit = scaleDifference({1.3, 0.02}, SensorConfig());
  EXPECT_NE(unit.find("shorter"), std::string::npos) << unit;
  EXPECT_NE(unit.find("unit of depth"), std::string::npos) << unit;
  EXPECT_EQ(unit.find("should be"), std::string::npos) << unit;
}
