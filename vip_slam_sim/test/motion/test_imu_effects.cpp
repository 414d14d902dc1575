// SPDX-License-Identifier: BSD-3-Clause
// What real IMUs measure beyond motion, constant bias and white noise.
#include <gtest/gtest.h>

#include "test_support.h"
#include "vip_slam_sim/motion/imu_drift.h"
#include "vip_slam_sim/motion/motion_generator.h"

namespace vip_slam {
namespace {

MotionOptions atRest(const std::string& vibration) {
  MotionOptions o;
  o.type = "still";
  o.duration = 60;
  o.vibration = vibration;
  return o;
}

ImuOptions noNoise() {
  ImuOptions o;
  o.gyro_noise_density = o.gyro_random_walk = o.accel_noise_density = o.accel_random_walk = 0;
  o.gyro_bias = o.accel_bias = 0;
  return o;
}

/// Root mean square of what lies between two frequencies, by a plain Fourier sum.
double bandRms(const std::vector<double>& x, double rate, double low, double high) {
  const std::size_t n = std::min<std::size_t>(x.size(), 1000);
  double sum = 0;
  for (std::size_t k = 1; k < n / 2; ++k) {
    const double f = static_cast<double>(k) * rate / static_cast<double>(n);
    if (f < low || f >= high) continue;
    double re = 0, im = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double window = 0.5 - 0.5 * std::cos(2 * M_PI * double(i) / double(n));
      re += window * x[i] * std::cos(2 * M_PI * double(k * i % n) / double(n));
      im += window * x[i] * std::sin(2 * M_PI * double(k * i % n) / double(n));
    }
    sum += (re * re + im * im) / (0.375 * double(n) * double(n)) * 2;
  }
  return std::sqrt(sum);
}

/// EuRoC V1_01_easy in flight, from 20 Hz on: accelerometer 1.05, 0.51, 0.82 m/s^2, gyroscope 0.018, 0.041, 0.023
/// rad/s, with a line at 27.7 Hz and most of the rest about 90 Hz.
TEST(Vibration, OfRotorsHasTheMeasuredSpectrum) {
  const SplineTrajectory s = makeMotion(atRest("rotors"), SE3(), 3);
  const ImuLog log = synthesiseImu(s, noNoise(), 3);
  std::vector<double> accel[3], gyro[3];
  for (const ImuSample& m : log.samples)
    for (int k = 0; k < 3; ++k) accel[k].push_back(m.accel[k]), gyro[k].push_back(m.gyro[k]);
  const double accel_rms[3] = {1.05, 0.51, 0.82}, gyro_rms[3] = {0.018, 0.041, 0.023};
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(bandRms(accel[k], 200, 20, 100) / accel_rms[k], 1, 0.25) << k;
    EXPECT_NEAR(bandRms(gyro[k], 200, 20, 100) / gyro_rms[k], 1, 0.25) << k;
    EXPECT_LT(bandRms(gyro[k], 200, 1, 10), 0.15 * gyro_rms[k]) << k;
  }
  EXPECT_GT(bandRms(accel[1], 200, 25, 30), 0.15);                               // the line
  EXPECT_GT(bandRms(gyro[1], 200, 80, 100), 2 * bandRms(gyro[1], 200, 40, 80));  // rotors
}

/// An iPhone carried through an office, from 8 Hz on: 0.14, 0.05, 0.13 m/s^2 and 0.020, 0.043, 0.012 rad/s.
TEST(Vibration, OfAHandHasTheMeasuredSpectrum) {
  ImuOptions o = noNoise();
  o.rate = 100;
  const ImuLog log = synthesiseImu(makeMotion(atRest("hand"), SE3(), 4), o, 4);
  const double accel_rms[3] = {0.139, 0.0495, 0.127}, gyro_rms[3] = {0.0203, 0.0434, 0.012};
  for (int k = 0; k < 3; ++k) {
    std::vector<double> a, g;
    for (const ImuSample& m : log.samples) a.push_back(m.accel[k]), g.push_back(m.gyro[k]);
    EXPECT_NEAR(bandRms(a, 100, 5, 50) / accel_rms[k], 1, 0.25) << k;
    EXPECT_NEAR(bandRms(g, 100, 5, 50) / gyro_rms[k], 1, 0.25) << k;
    EXPECT_GT(bandRms(g, 100, 5, 17), 3 * bandRms(g, 100, 17, 50)) << k;
  }
  EXPECT_THROW(Vibration("earthquake", 1), std::invalid_argument);
}

/// Body and camera really shake: the pose's differences are the IMU's velocity, rate and acceleration.
TEST(Vibration, MovesTheBodyAsTheImuSays) {
  MotionOptions o = loadSequence("smoke", libraryPath()).motion;
  o.vibration = "hand";
  const SplineTrajectory s = makeMotion(o, SE3(), 6);
  const double h = 1e-4;
  for (double t = 5.01; t < 9; t += 0.171) {
    const MotionState m = s.at(t), a = s.at(t - h), b = s.at(t + h);
    EXPECT_LT(((b.T_W_I.t() - a.T_W_I.t()) / (2 * h) - m.v_W).norm(), 1e-4);
    EXPECT_LT(((b.v_W - a.v_W) / (2 * h) - m.a_W).norm(), 2e-3);
    const Eigen::Vector3d turn = logSO3(a.T_W_I.rotation().conjugate() * b.T_W_I.rotation()) / (2 * h);
    EXPECT_LT((turn - m.omega_I).norm(), 1e-3);
  }
}

TEST(ThermalDrift, GrowsTowardsItsEnd) {
  ImuOptions o = noNoise();
  o.gyro_drift = 0.01;
  o.accel_drift = 0.2;
  o.warm_up = 20;
  const SplineTrajectory s = makeMotion(atRest("none"), SE3(), 8);
  const ImuLog with = synthesiseImu(s, o, 8), without = synthesiseImu(s, noNoise(), 8);
  const ThermalDrift drift(o, 8);
  double squares = 0;
  for (int seed = 0; seed < 300; ++seed) squares += ThermalDrift(o, seed).gyro(1e6).squaredNorm() / 900;
  EXPECT_NEAR(std::sqrt(squares), 0.01, 0.001);
  const Eigen::Vector3d end = drift.gyro(1e6);
  EXPECT_LT((with.samples[4000].gyro - without.samples[4000].gyro - (1 - std::exp(-1)) * end).norm(), 1e-9);  // 20 s
  EXPECT_LT((with.biases[4000].gyro - (1 - std::exp(-1)) * end).norm(), 1e-9);
  EXPECT_LT((with.biases[0].gyro).norm(), 1e-12);
  EXPECT_LT((with.samples[4000].accel - without.samples[4000].accel - drift.accel(20)).norm(), 1e-9);
}

TEST(GSensitivity, TurnsWithTheForce) {
  ImuOptions o = noNoise();
  o.g_sensitivity = 1e-3;
  const SplineTrajectory s = makeMotion(loadSequence("smoke", libraryPath()).motion, SE3(), 9);
  const ImuLog with = synthesiseImu(s, o, 9), without = synthesiseImu(s, noNoise(), 9);
  const GSensitivity felt(o, 9);
  double most = 0;
  for (std::size_t k = 0; k < with.samples.size(); k += 50) {
    const Eigen::Vector3d extra = with.samples[k].gyro - without.samples[k].gyro;
    EXPECT_LT((extra - felt(without.samples[k].accel)).norm(), 1e-9);
    most = std::max(most, extra.norm());
  }
  EXPECT_GT(most, 0.003);
  EXPECT_LT(most, 0.05);
}

TEST(NoImu, MakesTheCameraTheBody) {
  const SequenceSpec spec = loadSequence("real_01", libraryPath());
  EXPECT_FALSE(spec.imu.present);
  EXPECT_FALSE(spec.sensorConfig().topics.hasInertial());
  EXPECT_LT(spec.T_imu_cam().t().norm() + spec.sensorConfig().T_imu_cam.t().norm(), 1e-12);
  EXPECT_LT(spec.T_imu_cam().rotation().vec().norm(), 1e-12);
}

TEST(StatedNoise, IsWhatTheSensorFileSays) {
  SequenceSpec spec = loadSequence("smoke", libraryPath());
  spec.imu.stated_noise = 5;
  EXPECT_DOUBLE_EQ(spec.sensorConfig().imu_noise.gyro_noise_density, 5 * spec.imu.gyro_noise_density);
}

}  // namespace
}  // namespace vip_slam
