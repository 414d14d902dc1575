// SPDX-License-Identifier: BSD-3-Clause
// The real IMU of EuRoC V1_01 with its ground truth, when the data are there: VIP_SLAM_REAL_DATA names the folder that
// holds euroc_v101/{imu,truth}.csv.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <Eigen/QR>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/imu/imu_buffer.h"
#include "vip_slam_core/imu/preintegration.h"

namespace vip_slam {
namespace {

std::vector<std::vector<double>> readCsv(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<double> row;
    std::istringstream in(line);
    for (std::string cell; std::getline(in, cell, ',');) row.push_back(std::stod(cell));
    rows.push_back(row);
  }
  return rows;
}

Eigen::Vector3d vector(const std::vector<double>& row, int at) { return {row[at], row[at + 1], row[at + 2]}; }

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

struct Errors {
  std::vector<double> position, velocity, rotation, heading, position_levelled;

  void add(const std::vector<ImuSample>& samples, const NavState& start, const NavState& end, const ImuNoise& noise) {
    const Preintegration pre(samples, start.bias_gyro, start.bias_accel, noise);
    const NavState predicted = pre.predict(start, gravityVector(9.81));
    position.push_back((predicted.T_W_I.t() - end.T_W_I.t()).norm());
    velocity.push_back((predicted.v_W - end.v_W).norm());
    const Eigen::Vector3d turn = logSO3(predicted.T_W_I.rotation() * end.T_W_I.rotation().conjugate());
    rotation.push_back(turn.norm());
    heading.push_back(std::abs(turn.z()));

    // Tilting the start by (x, y, 0) in the world changes the end's velocity by that cross R_i beta.
    const Eigen::Matrix<double, 3, 2> M = -hat(start.T_W_I.rotation() * pre.beta()).leftCols<2>();
    const Eigen::Vector2d tilt = M.colPivHouseholderQr().solve(end.v_W - predicted.v_W);
    NavState levelled = start;
    levelled.T_W_I.setRotation(expQuaternion({tilt.x(), tilt.y(), 0}) * start.T_W_I.rotation());
    position_levelled.push_back((pre.predict(levelled, gravityVector(9.81)).T_W_I.t() - end.T_W_I.t()).norm());
  }
  void print(const char* duration) const {
    std::printf(
        "after %s, medians of %zu windows: position %.1f mm (start levelled: %.1f mm), velocity %.1f mm/s, "
        "rotation %.3f deg, of it heading %.3f deg\n",
        duration, position.size(), 1e3 * median(position), 1e3 * median(position_levelled), 1e3 * median(velocity),
        median(rotation) / kDegree, median(heading) / kDegree);
  }
};

TEST(RealImu, PreintegrationFollowsTheTruth) {
  const char* folder = std::getenv("VIP_SLAM_REAL_DATA");
  if (!folder) GTEST_SKIP() << "VIP_SLAM_REAL_DATA is not set";
  const auto imu = readCsv(std::string(folder) + "/euroc_v101/imu.csv");
  const auto truth = readCsv(std::string(folder) + "/euroc_v101/truth.csv");
  if (imu.empty() || truth.empty()) GTEST_SKIP() << folder << " holds no euroc_v101";

  // Nanoseconds since 1970 lose their last digits in a double: count from the first sample.
  const double t0 = imu.front()[0];
  ImuBuffer buffer(0.05, 1e9);
  for (const auto& row : imu) {
    ImuSample sample;
    sample.t = (row[0] - t0) * 1e-9;
    sample.gyro = vector(row, 1);
    sample.accel = vector(row, 4);
    ASSERT_TRUE(buffer.add(sample));
  }
  EXPECT_EQ(buffer.counters().spikes, 0u);  // rotors: successive samples differ by 2 m/s^2, at most by 12
  std::vector<NavState> states;
  for (const auto& row : truth) {
    NavState state;
    state.t = (row[0] - t0) * 1e-9;
    state.T_W_I = SE3(Eigen::Quaterniond(row[4], row[5], row[6], row[7]), vector(row, 1));
    state.v_W = vector(row, 8);
    state.bias_gyro = vector(row, 11);
    state.bias_accel = vector(row, 14);
    states.push_back(state);
  }

  ImuNoise noise;  // the data set's sensor.yaml
  noise.gyro_noise_density = 1.6968e-4;
  noise.gyro_random_walk = 1.9393e-5;
  noise.accel_noise_density = 2.0e-3;
  noise.accel_random_walk = 3.0e-3;
  const auto evaluate = [&](std::size_t steps, double late = 0) {
    Errors errors;
    for (std::size_t i = 0; i + steps < states.size(); i += 100) {
      auto samples = buffer.between(states[i].t + late, states[i + steps].t + late);
      for (ImuSample& sample : samples) sample.t -= late;
      if (!samples.empty()) errors.add(samples, states[i], states[i + steps], noise);
    }
    return errors;
  };

  // A tenth of a second: everything follows directly.
  const Errors brief = evaluate(20);
  ASSERT_GT(brief.position.size(), 200u);
  brief.print("0.1 s");
  EXPECT_LT(median(brief.position), 0.001);
  EXPECT_LT(median(brief.velocity), 0.015);
  EXPECT_LT(median(brief.rotation), 0.06 * kDegree);
  EXPECT_LT(median(brief.position_levelled), 0.0003);

  // Two seconds. Roll and pitch of this truth wander against the gyro by some tenths of a degree a second while its yaw
  // does not; that the orientation published for V1_01 is off is known (OpenVINS recomputed it). So the heading must
  // hold as it is, and the position gain once the start's tilt has been fitted to the end's velocity.
  const Errors full = evaluate(400);
  full.print("2 s");
  EXPECT_LT(median(full.heading), 0.15 * kDegree);
  EXPECT_LT(median(full.position_levelled), 0.5 * median(full.position));
  EXPECT_LT(median(full.position_levelled), 0.09);

  // Control: samples that are stamped 5 ms late fail all of it.
  const Errors late = evaluate(20, 0.005);
  late.print("0.1 s, 5 ms late");
  EXPECT_GT(median(late.position_levelled), 2 * median(brief.position_levelled));
  EXPECT_GT(median(late.heading), 2 * median(brief.heading));
}

}  // namespace
}  // namespace vip_slam
