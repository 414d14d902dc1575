// SPDX-License-Identifier: BSD-3-Clause
// A smooth 6-DoF motion with exact derivatives and its ideal IMU, for tests of estimators.
// Position is a sum of sines; orientation is ZYX Euler angles of sines, whose body rate is exact.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam::testing {

class AnalyticMotion {
 public:
  /// `scale` stretches amplitudes: 1 is about 1 m, 0.5 m/s and 0.6 rad/s.
  explicit AnalyticMotion(unsigned seed = 1, double scale = 1.0) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> u(0.0, 1.0);
    for (int axis = 0; axis < 6; ++axis) {
      for (int k = 0; k < 3; ++k) {
        Sine& s = sines_[axis][k];
        s.omega = 0.3 + 0.4 * k + 0.3 * u(rng);
        s.phase = 6.28 * u(rng);
        s.amplitude = scale * (axis < 3 ? 0.5 : 0.25) * (0.5 + u(rng)) / (1 + k);
      }
    }
  }

  NavState stateAt(double t) const {
    NavState state;
    state.t = t;
    const Vec6 x = value(t, 0), v = value(t, 1);
    state.T_W_I = SE3(rotation(x), x.head<3>());
    state.v_W = v.head<3>();
    return state;
  }

  Eigen::Vector3d bodyRate(double t) const {
    const Vec6 x = value(t, 0), v = value(t, 1);
    const double roll = x[3], pitch = x[4];
    const double dr = v[3], dp = v[4], dy = v[5];
    return {dr - std::sin(pitch) * dy, std::cos(roll) * dp + std::sin(roll) * std::cos(pitch) * dy,
            -std::sin(roll) * dp + std::cos(roll) * std::cos(pitch) * dy};
  }

  ImuSample imuAt(double t, const Eigen::Vector3d& bias_gyro = Eigen::Vector3d::Zero(),
                  const Eigen::Vector3d& bias_accel = Eigen::Vector3d::Zero(), double g = 9.81) const {
    ImuSample sample;
    sample.t = t;
    sample.gyro = bodyRate(t) + bias_gyro;
    const Eigen::Vector3d a_W = value(t, 2).head<3>();
    sample.accel = rotation(value(t, 0)).transpose() * (a_W + gravityVector(g)) + bias_accel;
    return sample;
  }

  /// Samples from t0 to t1, both included, at `rate` Hz.
  std::vector<ImuSample> imu(double t0, double t1, double rate,
                             const Eigen::Vector3d& bias_gyro = Eigen::Vector3d::Zero(),
                             const Eigen::Vector3d& bias_accel = Eigen::Vector3d::Zero(), double g = 9.81) const {
    std::vector<ImuSample> samples;
    const int n = static_cast<int>(std::lround((t1 - t0) * rate));
    for (int k = 0; k <= n; ++k) samples.push_back(imuAt(t0 + (t1 - t0) * k / n, bias_gyro, bias_accel, g));
    return samples;
  }

 private:
  using Vec6 = Eigen::Matrix<double, 6, 1>;
  struct Sine {
    double amplitude, omega, phase;
  };
  Vec6 value(double t, int derivative) const {
    Vec6 out = Vec6::Zero();
    for (int axis = 0; axis < 6; ++axis)
      for (const Sine& s : sines_[axis])
        out[axis] +=
            s.amplitude * std::pow(s.omega, derivative) * std::sin(s.omega * t + s.phase + derivative * M_PI / 2);
    return out;
  }
  static Eigen::Matrix3d rotation(const Vec6& x) {
    return (Eigen::AngleAxisd(x[5], Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(x[4], Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(x[3], Eigen::Vector3d::UnitX()))
        .toRotationMatrix();
  }
  Sine sines_[6][3];
};

}  // namespace vip_slam::testing
