// SPDX-License-Identifier: BSD-3-Clause
// The scale and alignment of the gyro's axes as states of the filter.
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "landmark_simulation.h"

namespace vip_slam::testing {
namespace {

/// With the gyro noise of real cameras.
SimulationOptions goodGyro(std::uint32_t seed) {
  SimulationOptions simulation;
  simulation.seed = seed;
  simulation.sigma_px = 0.2;
  simulation.noise.gyro_noise_density *= 0.2;
  simulation.noise.accel_noise_density *= 0.2;
  return simulation;
}

TEST(Calibration, FindsTheScaleOfTheGyro) {
  constexpr int kRuns = 6;
  double nees = 0, believed = 0, scale_nees = 0, error = 0, error_believed = 0;
  for (int seed = 1; seed <= kRuns; ++seed) {
    SimulationOptions simulation = goodGyro(seed);
    simulation.gyro_error.diagonal() << 0.006, -0.004, 0.008;
    simulation.noise.gyro_correction_sigma = 0.005;
    FilterOptions options = singlePixels();
    const RunResult run = runFilter(simulation, options, 20.0, false);
    const Eigen::Vector3d expected =
        (Eigen::Vector3d::Ones() + simulation.gyro_error.diagonal()).cwiseInverse() - Eigen::Vector3d::Ones();
    const Eigen::Vector3d off = run.calibration.gyro_correction.diagonal() - expected;
    scale_nees += off.cwiseQuotient(run.calibration.sigma_gyro_correction.diagonal()).squaredNorm() / kRuns;
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 0.003);
    for (int axis = 0; axis < 3; ++axis) {
      const double found = run.calibration.gyro_correction(axis, axis);
      const bool sure = std::abs(found) > 4.0 * run.calibration.sigma_gyro_correction(axis, axis);
      // Once significant it stays passed on.
      const double handed_on = run.gyro_correction(axis, axis);
      EXPECT_TRUE(handed_on == found || (!sure && handed_on == 0)) << handed_on << " of " << found;
    }
    EXPECT_GT(run.gyro_correction.cwiseAbs().maxCoeff(), 0.005);
    nees += run.nees / kRuns;
    options.calibration.gyro_scale = false;
    options.adapt_imu_noise = false;
    const RunResult unknown = runFilter(simulation, options, 20.0, false);
    believed += unknown.nees / kRuns;
    error += run.final_position / kRuns;
    error_believed += unknown.final_position / kRuns;
  }
  std::printf("NEES %.2f (scale, 3: %.2f), %.1f mm; gyro believed: %.2f, %.1f mm\n", nees, scale_nees, 1e3 * error,
              believed, 1e3 * error_believed);
  EXPECT_LT(nees, 9.0);
  EXPECT_LT(scale_nees, 7.0);
  // What a wrong gyro and the images dispute widens sigma: the pose is honest even so.
  EXPECT_LT(believed, 12.0);
  EXPECT_LT(error, 0.8 * error_believed);
}

TEST(Calibration, FindsHowTheGyroIsMisaligned) {
  SimulationOptions simulation = goodGyro(3);
  simulation.gyro_error << 0.004, 0.006, -0.005, -0.007, -0.003, 0.008, 0.006, -0.004, 0.005;
  simulation.noise.gyro_correction_sigma = 0.005;
  FilterOptions options = singlePixels();
  options.calibration.gyro_misalignment = true;
  const RunResult run = runFilter(simulation, options, 40.0, false);
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d left = (I + run.calibration.gyro_correction) * (I + simulation.gyro_error) - I;
  EXPECT_LT(left.norm(), 0.3 * simulation.gyro_error.norm());
  EXPECT_LT((left.array().abs() / run.calibration.sigma_gyro_correction.array()).maxCoeff(), 4.0);
}

// The estimate varies about zero and must not be passed on.
TEST(Calibration, AnExactGyroIsHandedOnAsItIs) {
  for (int seed = 1; seed <= 3; ++seed) {
    const RunResult run = runFilter(goodGyro(seed), singlePixels(), 15.0, false);
    EXPECT_NE(run.calibration.gyro_correction.norm(), 0.0);
    EXPECT_EQ(run.most_gyro_correction, 0.0);
  }
}

}  // namespace
}  // namespace vip_slam::testing
