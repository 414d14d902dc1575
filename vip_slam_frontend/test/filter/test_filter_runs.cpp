// SPDX-License-Identifier: BSD-3-Clause
// Whole-filter runs on the landmark simulation: outliers, noise adaptation, standing still.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "landmark_simulation.h"
#include "vip_slam_core/geometry/angle.h"

namespace vip_slam::testing {
namespace {

// All information from the first second of motion is weighted with the initial sigma, so a wrong one must be corrected
// soon.
TEST(NoiseMonitor, AWrongStartIsForgottenWithinThreeImages) {
  for (const double truth : {0.03, 0.5, 1.5}) {
    NoiseMonitor monitor(0.5, 0.01);
    for (int image = 0; image < 3; ++image) monitor.add(std::pow(truth / monitor.sigma(), 2), 60);
    EXPECT_NEAR(std::log(monitor.sigma() / truth), 0.0, 0.1) << truth;
  }
}

TEST(FilterRuns, OutliersAreGatedAway) {
  SimulationOptions simulation;
  simulation.seed = 5;
  simulation.outlier_ratio = 0.01;
  const RunResult run = runFilter(simulation, singlePixels(), 15.0, false);
  EXPECT_GT(run.gated, 50);
  EXPECT_LT(run.final_position / run.length, 0.006);
}

/// Correction of the velocity, in sigmas of the IMU's prediction, caused by one track of a point that moves at `speed`
/// (m/s): each residual is small, but together they describe another motion.
double pulled(double speed, double pull_huber) {
  SimulationOptions still;
  still.speed = 0;
  still.imu_noise = false;
  LandmarkSimulation simulation(still);
  simulation.generateImu(1.0);
  FilterOptions options = singlePixels();
  options.pull_huber = pull_huber;
  options.sigma_px = 1.0;  // one track has about the weight of the prior
  VioFilter filter(options, still.noise, simulation.T_I_C(), 0.0, still.focal, 9.81);
  FilterPrior prior;
  prior.state = simulation.stateAt(0.2);
  prior.sigma_velocity = 0.005;
  prior.sigma_tilt = 1e-4, prior.sigma_bias_gyro = 1e-4, prior.sigma_bias_accel = 1e-3;
  CloneId id = 1;
  filter.start(prior, id++, Eigen::Vector3d::Zero());
  const SE3 T_W_C = prior.state.T_W_I * simulation.T_I_C();
  for (int k = 1; k <= 9; ++k) {
    const double t = 0.2 + 0.05 * k;
    const Propagation propagation = filter.predict(simulation.imuBetween(filter.nav().t, t));
    const Eigen::Vector3d p_C(speed * 0.05 * k, 0.3, 3.0);
    FilterMeasurement m;
    m.id = 1, m.xy = p_C.head<2>() / p_C.z(), m.depth = p_C.z(), m.depth_sigma = 0.01;
    const bool in_view = k < 9;  // tracks are used when they end
    filter.step(propagation, id++, in_view ? std::vector<FilterMeasurement>{m} : std::vector<FilterMeasurement>(),
                std::nullopt);
  }
  return -T_W_C.R().col(0).dot(filter.nav().v_W);
}

TEST(FilterRuns, WhatAsksForTooMuchPullsLess) {
  const double little = pulled(0.012, 1.0), much = pulled(0.12, 1.0);
  const double little_freely = pulled(0.012, 1000.0), much_freely = pulled(0.12, 1000.0);
  std::printf("a point at 12 mm/s gives the body %.2f mm/s, at 120 mm/s %.2f; freely %.2f and %.2f\n", 1e3 * little,
              1e3 * much, 1e3 * little_freely, 1e3 * much_freely);
  EXPECT_NEAR(much_freely, 10.0 * little_freely, 0.1 * much_freely);
  EXPECT_NEAR(little, little_freely, 1e-9);
  EXPECT_GT(much, little);
  EXPECT_LT(much, 0.8 * much_freely);
}

// The motion between two keyframes a minute of rest apart is known as accurately as zero velocity makes each image.
TEST(FilterRuns, StandingDoesNotWearOutTheMotionBetweenKeyframes) {
  SimulationOptions still;
  still.speed = 0;
  LandmarkSimulation simulation(still);
  simulation.generateImu(32.0);
  const FilterOptions options = singlePixels();
  for (const int marked : {0, 1, 2, 5}) {  // still images before the first keyframe
    VioFilter filter(options, still.noise, simulation.T_I_C(), 0.0, still.focal, 9.81);
    FilterPrior prior;
    prior.state = simulation.stateAt(0.2);
    CloneId id = 1;
    filter.start(prior, id++, Eigen::Vector3d::Zero());
    double after_a_second = 0;
    for (int k = 0; k <= 600; ++k) {
      if (k == marked) filter.markNewest();
      const Propagation propagation = filter.predict(simulation.imuBetween(filter.nav().t, 0.25 + 0.05 * k));
      filter.step(propagation, id++, {}, ResidualMotion{0.002, 0.005});
      if (k == marked + 20) after_a_second = std::sqrt(filter.motionSinceMark().covariance.diagonal().tail<3>().sum());
    }
    const RelativeMotion motion = filter.motionSinceMark();
    ASSERT_TRUE(motion.isUsable());
    const double sigma = std::sqrt(motion.covariance.diagonal().tail<3>().sum());
    std::printf("marked after %d still images: %.2f mm +- %.2f (after a second %.2f)\n", marked,
                1e3 * motion.T_a_b.t().norm(), 1e3 * sigma, 1e3 * after_a_second);
    EXPECT_LT(sigma, 1.5 * after_a_second);
    EXPECT_LT(motion.T_a_b.t().norm(), 3.0 * sigma);
  }
}

// Their first residuals come from the velocity error: if taken for measurement noise, the error stays at 0.8 m/s.
TEST(FilterRuns, PointsThatComeBackAfterAStretchWithoutTellTheVelocity) {
  double sum = 0;
  for (const std::uint32_t seed : {1, 2, 3, 4}) {
    SimulationOptions simulation;
    simulation.seed = seed;
    simulation.sigma_px = 0.05;
    simulation.most_points = 4;
    simulation.blind_from = 4.0;
    simulation.blind_until = 10.0;
    FilterOptions options = singlePixels();
    options.sigma_px = 0.05;
    sum += runFilter(simulation, options, 10.8, false).final_velocity;
  }
  EXPECT_LT(sum / 4, 0.2);
}

TEST(FilterRuns, PixelNoiseIsLearnt) {
  SimulationOptions simulation;
  simulation.seed = 3;
  simulation.sigma_px = 1.0;
  FilterOptions options = singlePixels();
  options.sigma_px = 0.4;
  const RunResult run = runFilter(simulation, options, 15.0, false);
  EXPECT_NEAR(run.nis_per_dof, 1.0, 0.25);
}

TEST(FilterRuns, DepthNoisierThanToldIsFoundOut) {
  SimulationOptions simulation;
  simulation.seed = 6;
  EXPECT_LT(runFilter(simulation, singlePixels(), 10.0, false).depth_noise_scale, 1.1);
  simulation.depth_told = 1.0 / 3.0;
  const RunResult run = runFilter(simulation, singlePixels(), 10.0, false);
  std::printf("depth noise three times what was told: found %.2f\n", run.depth_noise_scale);
  EXPECT_NEAR(run.depth_noise_scale, 3.0, 0.6);
}

/// An IMU with data sheet noise that vibrates: the images are more accurate, which the filter must detect.
TEST(FilterRuns, AnImuNoisierThanToldIsFoundOut) {
  SimulationOptions simulation;
  simulation.noise_told = 0.1;
  FilterOptions options = singlePixels();
  double told = 0, honest = 0, error_told = 0, error_honest = 0;
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    simulation.seed = seed;
    options.adapt_imu_noise = false;
    const RunResult without = runFilter(simulation, options, 15.0, false);
    options.adapt_imu_noise = true;
    const RunResult with = runFilter(simulation, options, 15.0, false);
    told += without.nees / 5;
    honest += with.nees / 5;
    error_told += without.final_position / 5;
    error_honest += with.final_position / 5;
  }
  std::printf("NEES %.1f, error %.1f mm; with the noise found out %.1f, %.1f mm\n", told, 1e3 * error_told, honest,
              1e3 * error_honest);
  EXPECT_GT(told, 20.0);
  EXPECT_LT(honest, 0.8 * told);
  EXPECT_LT(error_honest, 0.8 * error_told);
}

TEST(StandingStill, FiveMinutesWithoutDrift) {
  SimulationOptions simulation;
  simulation.seed = 2;
  simulation.speed = 0;
  simulation.image_rate = 15;
  const RunResult run = runFilter(simulation, singlePixels(), 300.0, true);
  std::printf("five minutes: %.2f mm, %.3f deg\n", 1e3 * run.final_position, run.final_rotation / kDegree);
  EXPECT_LT(run.final_position, 0.005);
  EXPECT_LT(run.final_rotation / kDegree, 0.2);  // includes the initial tilt error
  EXPECT_LE(run.window.clones.size(), 3u);
}

}  // namespace
}  // namespace vip_slam::testing
