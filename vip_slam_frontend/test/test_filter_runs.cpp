// Whole-filter runs on the landmark simulation: outliers, noise adaptation, standing still, calibration.
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "landmark_simulation.h"

namespace vip_slam::testing {
namespace {

/// The simulation's depth readings are single pixels, not medians, and its pixel errors independent.
FilterOptions filterOptions() {
  FilterOptions options;
  options.depth_inflation = 1.0;
  options.pixel_inflation = 1.0;
  options.own_noise = false;
  options.pull_huber = 1000.0;
  return options;
}

// Whatever is known of a motion's first second was weighed with the start's sigma.
TEST(NoiseMonitor, AWrongStartIsForgottenWithinThreeImages) {
  for (const double truth : {0.03, 0.5, 1.5}) {
    NoiseMonitor monitor(0.5, 0.01, 2.0, true);
    for (int image = 0; image < 3; ++image) monitor.add(std::pow(truth / monitor.sigma(), 2), 60);
    EXPECT_NEAR(std::log(monitor.sigma() / truth), 0.0, 0.1) << truth;
  }
}

TEST(StampMonitor, FindsTheJitterOfStampsAndNoneWhereThereIsNone) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (const double truth : {0.0, 0.001, 0.003}) {
    StampMonitor monitor(true);
    for (int image = 0; image < 400; ++image) {
      const Eigen::Vector3d omega(0.5 * std::sin(0.3 * image), 0.6 * std::cos(0.21 * image), 0.1);
      // One update: the orientation as predicted, off by the gyro's noise and the stamps', against a better
      // measurement.
      const double gyro = 4e-5, image_sigma = 2e-4;
      const Eigen::Vector3d error = gyro * Eigen::Vector3d(normal(random), normal(random), normal(random)) +
                                    std::sqrt(2.0) * truth * normal(random) * omega;
      const Eigen::Vector3d measured =
          error + image_sigma * Eigen::Vector3d(normal(random), normal(random), normal(random));
      const Eigen::Matrix3d P =
          gyro * gyro * Eigen::Matrix3d::Identity() + 2 * monitor.sigma() * monitor.sigma() * omega * omega.transpose();
      const Eigen::Matrix3d K = P * (P + image_sigma * image_sigma * Eigen::Matrix3d::Identity()).inverse();
      monitor.add(omega, K * measured, K * P);
    }
    if (truth > 0) {
      EXPECT_NEAR(std::log(monitor.sigma() / truth), 0.0, 0.7) << truth;
    } else {
      EXPECT_LT(monitor.sigma(), 1e-4);
    }
  }
}

TEST(FilterRuns, OutliersAreGatedAway) {
  SimulationOptions simulation;
  simulation.seed = 5;
  simulation.outlier_ratio = 0.01;
  const RunResult run = runFilter(simulation, filterOptions(), 15.0, false);
  EXPECT_GT(run.gated, 50);
  EXPECT_LT(run.final_position / run.length, 0.006);
}

/// The correction of the velocity, in sigmas of what the IMU leaves of it, by one track of a point that in truth goes
/// at `speed` (m/s): each of its residuals is small, all of them together are another motion.
double pulled(double speed, double pull_huber) {
  SimulationOptions still;
  still.speed = 0;
  still.imu_noise = false;
  LandmarkSimulation simulation(still);
  simulation.generateImu(1.0);
  FilterOptions options = filterOptions();
  options.pull_huber = pull_huber;
  options.sigma_px = 1.0;  // one track says about as much as the start
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
    const bool in_view = k < 9;  // what is lost is used
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

TEST(FilterRuns, PixelNoiseIsLearnt) {
  SimulationOptions simulation;
  simulation.seed = 3;
  simulation.sigma_px = 1.0;
  FilterOptions options = filterOptions();
  options.sigma_px = 0.4;
  const RunResult run = runFilter(simulation, options, 15.0, false);
  EXPECT_NEAR(run.nis_per_dof, 1.0, 0.25);
}

TEST(FilterRuns, DepthNoisierThanToldIsFoundOut) {
  SimulationOptions simulation;
  simulation.seed = 6;
  EXPECT_LT(runFilter(simulation, filterOptions(), 10.0, false).depth_scale, 1.1);
  simulation.depth_told = 1.0 / 3.0;
  const RunResult run = runFilter(simulation, filterOptions(), 10.0, false);
  std::printf("depth noise three times what was told: found %.2f\n", run.depth_scale);
  EXPECT_NEAR(run.depth_scale, 3.0, 0.6);
}

/// A data sheet's IMU that shakes: the images know better, and the filter must come to say so.
TEST(FilterRuns, AnImuNoisierThanToldIsFoundOut) {
  SimulationOptions simulation;
  simulation.noise_told = 0.1;
  FilterOptions options = filterOptions();
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
  EXPECT_LT(honest, 0.5 * told);
  EXPECT_LT(error_honest, error_told);
}

TEST(StandingStill, FiveMinutesWithoutDrift) {
  SimulationOptions simulation;
  simulation.seed = 2;
  simulation.speed = 0;
  simulation.image_rate = 15;
  const RunResult run = runFilter(simulation, filterOptions(), 300.0, true);
  std::printf("five minutes: %.2f mm, %.3f deg\n", 1e3 * run.final_position, run.final_rotation * 180 / M_PI);
  EXPECT_LT(run.final_position, 0.005);
  EXPECT_LT(run.final_rotation * 180 / M_PI, 0.2);  // with the tilt error it starts with
  EXPECT_LE(run.window.clones.size(), 3u);
}

TEST(Calibration, FindsExtrinsicsAndDelay) {
  SimulationOptions simulation;
  simulation.seed = 4;
  simulation.speed = 1.5;
  simulation.time_offset = 0.008;
  FilterOptions options = filterOptions();
  options.calibration.translation = true;
  options.calibration.sigma_rotation = 0.02;
  options.calibration.sigma_translation = 0.03;
  options.calibration.sigma_time_offset = 0.01;
  const SE3 wrong(expSO3(Eigen::Vector3d(0.012, -0.01, 0.015)), Eigen::Vector3d(0.015, -0.01, 0.02));
  const RunResult run = runFilter(simulation, options, 40.0, false, wrong, 0.0);
  const LandmarkSimulation truth(simulation);
  const Vector6d error = run.window.T_I_C.boxminus(truth.T_I_C());
  std::printf("extrinsics off by %.2f mrad, %.1f mm; delay by %.2f ms\n", 1e3 * error.head<3>().norm(),
              1e3 * error.tail<3>().norm(), 1e3 * std::abs(run.window.time_offset - 0.008));
  EXPECT_LT(error.head<3>().norm(), 0.003);
  EXPECT_LT(error.tail<3>().norm(), 0.015);
  EXPECT_NEAR(run.window.time_offset, 0.008, 0.001);
}

// A camera that is turned by 0.8 degrees against what is configured, while the body hardly turns: what cannot be told
// yet has to stay unsure.
TEST(Calibration, IsHonestWhileTheMotionSaysLittle) {
  double nees = 0, believed = 0;
  constexpr int kRuns = 8;
  for (int seed = 1; seed <= kRuns; ++seed) {
    SimulationOptions simulation;
    simulation.seed = seed;
    simulation.speed = 0.25;
    FilterOptions options = filterOptions();
    const SE3 wrong(expSO3(Eigen::Vector3d(0.008, -0.009, 0.007)), Eigen::Vector3d::Zero());
    nees += runFilter(simulation, options, 20.0, false, wrong, 0.003).nees / kRuns;
    options.calibration.rotation = options.calibration.time_offset = false;
    believed += runFilter(simulation, options, 20.0, false, wrong, 0.003).nees / kRuns;
  }
  std::printf("NEES with a camera turned by 0.8 degrees: %.2f, the configuration believed: %.2f\n", nees, believed);
  EXPECT_LT(nees, 9.0);
  EXPECT_GT(believed, 3.0 * nees);
}

TEST(Calibration, FindsWhatDepthIsTooLongBy) {
  double nees = 0, believed = 0, offset_nees = 0;
  constexpr int kRuns = 6;
  for (int seed = 1; seed <= kRuns; ++seed) {
    SimulationOptions simulation;
    simulation.seed = seed;
    simulation.depth_offset = 0.01;
    simulation.depth_a = 0.001;
    simulation.depth_c = 0.0005;
    simulation.sigma_px = 0.2;
    FilterOptions options = filterOptions();
    options.calibration.time_offset = false;  // which so noisy a gyro misleads
    const RunResult run = runFilter(simulation, options, 20.0, false);
    EXPECT_NEAR(run.mounting.depth_offset, -0.01, 0.002);
    EXPECT_NEAR(run.most_depth_correction, -0.01, 0.003);
    offset_nees += std::pow((run.mounting.depth_offset + 0.01) / run.mounting.sigma_depth_offset, 2) / kRuns;
    nees += run.nees / kRuns;
    options.calibration.depth_offset = false;
    believed += runFilter(simulation, options, 20.0, false).nees / kRuns;
  }
  std::printf("NEES with depth 1 cm too long: %.2f, of the offset %.2f; depth believed: %.2f\n", nees, offset_nees,
              believed);
  EXPECT_LT(nees, 9.0);
  EXPECT_LT(offset_nees, 2.5);
  EXPECT_GT(believed, 1.5 * nees);
}

// The estimate wanders about zero, and nobody is told.
TEST(Calibration, ExactDepthIsHandedOnAsItIs) {
  for (int seed = 1; seed <= 3; ++seed) {
    SimulationOptions simulation;
    simulation.seed = seed;
    const RunResult run = runFilter(simulation, filterOptions(), 10.0, false);
    EXPECT_NE(run.mounting.depth_offset, 0.0);
    EXPECT_EQ(run.most_depth_correction, 0.0);
  }
}

/// A gyro as cameras have them.
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
  double nees = 0, believed = 0, scale_nees = 0;
  for (int seed = 1; seed <= kRuns; ++seed) {
    SimulationOptions simulation = goodGyro(seed);
    simulation.gyro_error.diagonal() << 0.006, -0.004, 0.008;
    simulation.noise.gyro_correction_sigma = 0.005;
    FilterOptions options = filterOptions();
    const RunResult run = runFilter(simulation, options, 20.0, false);
    const Eigen::Vector3d expected =
        (Eigen::Vector3d::Ones() + simulation.gyro_error.diagonal()).cwiseInverse() - Eigen::Vector3d::Ones();
    const Eigen::Vector3d off = run.mounting.gyro_correction.diagonal() - expected;
    scale_nees += off.cwiseQuotient(run.mounting.sigma_gyro_correction.diagonal()).squaredNorm() / kRuns;
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 0.003);
    for (int axis = 0; axis < 3; ++axis) {
      const double found = run.mounting.gyro_correction(axis, axis);
      const bool sure = std::abs(found) > 4.0 * run.mounting.sigma_gyro_correction(axis, axis);
      EXPECT_EQ(run.gyro_correction(axis, axis), sure ? found : 0.0) << "handed on once it is beyond doubt";
    }
    EXPECT_GT(run.gyro_correction.cwiseAbs().maxCoeff(), 0.005);
    nees += run.nees / kRuns;
    options.calibration.gyro_scale = false;
    believed += runFilter(simulation, options, 20.0, false).nees / kRuns;
  }
  std::printf("NEES with a gyro off by up to 0.8 %%: %.2f, of the scale (3) %.2f; gyro believed: %.2f\n", nees,
              scale_nees, believed);
  EXPECT_LT(nees, 9.0);
  EXPECT_LT(scale_nees, 7.0);
  EXPECT_GT(believed, 3 * nees);
}

TEST(Calibration, FindsHowTheGyroIsMisaligned) {
  SimulationOptions simulation = goodGyro(3);
  simulation.gyro_error << 0.004, 0.006, -0.005, -0.007, -0.003, 0.008, 0.006, -0.004, 0.005;
  simulation.noise.gyro_correction_sigma = 0.005;
  FilterOptions options = filterOptions();
  options.calibration.gyro_misalignment = true;
  const RunResult run = runFilter(simulation, options, 40.0, false);
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d left = (I + run.mounting.gyro_correction) * (I + simulation.gyro_error) - I;
  EXPECT_LT(left.norm(), 0.3 * simulation.gyro_error.norm());
  EXPECT_LT((left.array().abs() / run.mounting.sigma_gyro_correction.array()).maxCoeff(), 4.0);
}

// The estimate wanders about zero, and nobody is told.
TEST(Calibration, AnExactGyroIsHandedOnAsItIs) {
  for (int seed = 1; seed <= 3; ++seed) {
    const RunResult run = runFilter(goodGyro(seed), filterOptions(), 15.0, false);
    EXPECT_NE(run.mounting.gyro_correction.norm(), 0.0);
    EXPECT_EQ(run.most_gyro_correction, 0.0);
  }
}

// Such as colour and depth of different moments would ask for: no offset is better than a wrong one.
TEST(Calibration, AnOffsetOfDepthBeyondBeliefIsTakenBack) {
  SimulationOptions simulation;
  simulation.depth_offset = 0.06;
  FilterOptions options = filterOptions();
  const RunResult run = runFilter(simulation, options, 10.0, false);
  EXPECT_TRUE(run.mounting.depth_contradicts);
  EXPECT_NEAR(run.mounting.depth_offset, 0, 1e-4);
  EXPECT_EQ(mountingDifferences({run.mounting.T_I_C, run.mounting.time_offset}, run.mounting).size(), 1u);
  simulation.depth_offset = 0.01;
  EXPECT_FALSE(runFilter(simulation, options, 10.0, false).mounting.depth_contradicts);
}

TEST(Calibration, StandingTeachesNothing) {
  SimulationOptions simulation;
  simulation.speed = 0;
  simulation.seed = 5;
  const FilterOptions options = filterOptions();
  const RunResult run = runFilter(simulation, options, 60.0, true);
  const Vector6d change = run.window.T_I_C.boxminus(LandmarkSimulation(simulation).T_I_C());
  EXPECT_LT(change.norm(), 0.1 * options.calibration.sigma_rotation);
  EXPECT_LT(std::abs(run.window.time_offset), 0.1 * options.calibration.sigma_time_offset);
  EXPECT_LT(std::abs(run.window.depth_offset), 0.2 * options.calibration.sigma_depth_offset);
}

/// A filter that stands at the origin with this much said about its mounting by one measurement of it.
VioFilter taught(const FilterOptions& options, const SE3& given, const Eigen::Vector3d& turn) {
  VioFilter filter(options, ImuNoise(), given, 0.0, 500, 9.81);
  filter.start(FilterPrior(), 1, Eigen::Vector3d::Zero());
  const WindowState& window = filter.window();
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3, window.dimension());
  H.block<3, 3>(0, window.rotationColumn()).setIdentity();
  H *= 1e6;
  Eigen::VectorXd r = 1e6 * turn;
  const_cast<SquareRootFilter&>(filter.algebra()).update(H, r);
  return filter;
}

TEST(Calibration, OutlivesARestart) {
  const FilterOptions options = filterOptions();
  const SE3 given(expSO3(Eigen::Vector3d(0.3, 0.2, 0.1)), Eigen::Vector3d(0.05, 0, 0));
  const Eigen::Vector3d turn(0.006, -0.004, 0.003);
  VioFilter filter = taught(options, given, turn);
  EXPECT_LT((filter.mounting().T_I_C.boxminus(given).head<3>() - turn).norm(), 1e-5);
  EXPECT_GT(filter.mounting().sigma_rotation.minCoeff(), 0);
  filter.stop();
  EXPECT_LT((filter.mounting().T_I_C.boxminus(given).head<3>() - turn).norm(), 1e-5);
  filter.start(FilterPrior(), 9, Eigen::Vector3d::Zero());
  EXPECT_LT((filter.window().T_I_C.boxminus(given).head<3>() - turn).norm(), 1e-5);
  // But with the doubt of the first start: it may have been what went wrong.
  EXPECT_NEAR(filter.mounting().sigma_rotation.x(), options.calibration.sigma_rotation, 1e-6);
}

TEST(Calibration, OfTheGyroOutlivesARestartUnlessItIsBeyondBelief) {
  for (const double off : {-0.02, -0.08}) {
    VioFilter filter(filterOptions(), ImuNoise(), SE3(), 0.0, 500, 9.81);
    filter.start(FilterPrior(), 1, Eigen::Vector3d::Zero());
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, filter.window().dimension());
    H(0, filter.window().gyroColumn() + 1) = 1e6;
    Eigen::VectorXd r = Eigen::VectorXd::Constant(1, 1e6 * off);
    const_cast<SquareRootFilter&>(filter.algebra()).update(H, r);
    filter.stop();
    filter.start(FilterPrior(), 9, Eigen::Vector3d::Zero());
    Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
    if (off > -0.05) expected(1, 1) = off;
    EXPECT_LT((filter.window().gyro_correction - expected).norm(), 1e-5);
  }
}

TEST(Calibration, IsForgottenWhenItWentAstray) {
  const FilterOptions options = filterOptions();
  VioFilter filter = taught(options, SE3(), 6 * options.calibration.sigma_rotation * Eigen::Vector3d::UnitY());
  filter.stop();
  EXPECT_EQ(filter.mounting().T_I_C.matrix(), SE3().matrix());
}

TEST(Calibration, SaysWhatTheConfigurationShouldHave) {
  MountingEstimate given, found;
  found.T_I_C = SE3(expSO3(Eigen::Vector3d(0, 0.01, 0)), Eigen::Vector3d(0.02, 0, 0));
  found.time_offset = 0.004;
  EXPECT_TRUE(mountingDifferences(given, found).empty()) << "nothing was estimated";
  found.sigma_rotation.setConstant(0.0005);
  found.sigma_translation.setConstant(0.001);
  found.sigma_time_offset = 0.0002;
  found.depth_offset = -0.0098;
  found.sigma_depth_offset = 0.0003;
  const std::vector<std::string> all = mountingDifferences(given, found);
  ASSERT_EQ(all.size(), 4u);
  EXPECT_NE(all[0].find("0.57 degrees"), std::string::npos) << all[0];
  EXPECT_NE(all[1].find("20.0 mm"), std::string::npos) << all[1];
  EXPECT_NE(all[2].find("4.0 ms"), std::string::npos) << all[2];
  EXPECT_NE(all[3].find("9.8 mm too long"), std::string::npos) << all[3];
  EXPECT_NE(all[3].find("depth/offset in the sensor's configuration should be -0.0098"), std::string::npos) << all[3];
  given.depth_offset = -0.005;  // and is too long by what is left
  found.depth_offset = -0.012;
  const std::string more = mountingDifferences(given, found).back();
  EXPECT_NE(more.find("7.0 mm too long"), std::string::npos) << more;
  EXPECT_NE(more.find("-0.0120"), std::string::npos) << more;
  found.gyro_correction(1, 1) = -0.0123;
  found.sigma_gyro_correction(1, 1) = 0.0003;
  const std::string gyro = mountingDifferences(given, found).back();
  EXPECT_NE(gyro.find("up to 1.2 %"), std::string::npos) << gyro;
  EXPECT_NE(gyro.find("[0.0000, -0.0123, 0.0000]"), std::string::npos) << gyro;
  found.sigma_gyro_correction(1, 1) = 0.003;
  found.sigma_rotation.setConstant(0.01);  // not sure
  found.sigma_translation.setConstant(0.01);
  found.sigma_time_offset = 0.002;
  found.sigma_depth_offset = 0.002;
  EXPECT_TRUE(mountingDifferences(given, found).empty());
}

}  // namespace
}  // namespace vip_slam::testing
