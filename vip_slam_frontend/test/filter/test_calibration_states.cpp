// SPDX-License-Identifier: BSD-3-Clause
// Extrinsics, depth and gyro errors learnt by the filter: accuracy, consistency, and that they are passed on and kept.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "landmark_simulation.h"

namespace vip_slam::testing {
namespace {

/// Depth and pixels accurate enough to show small calibration errors.
SimulationOptions exactReadings(int seed) {
  SimulationOptions simulation;
  simulation.seed = static_cast<std::uint32_t>(seed);
  simulation.depth_a = 0.001;
  simulation.depth_c = 0.0005;
  simulation.sigma_px = 0.2;
  return simulation;
}

TEST(Calibration, FindsExtrinsicsAndDelay) {
  SimulationOptions simulation;
  simulation.seed = 4;
  simulation.speed = 1.5;
  simulation.time_offset = 0.008;
  simulation.noise.gyro_noise_density = 3e-4;  // below the motion, or the delay is held
  FilterOptions options = singlePixels();
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

// A change as from another exposure time. An estimator that assumes a constant delay would follow only a twentieth of
// it in that time.
TEST(Calibration, FollowsADelayThatChanges) {
  SimulationOptions simulation;
  simulation.seed = 6;
  simulation.image_rate = 30;
  simulation.sigma_px = 0.1;
  simulation.noise.gyro_noise_density = 2e-4;
  simulation.later = 40;
  simulation.later_time_offset = 0.004;
  FilterOptions options = singlePixels();
  const CalibrationEstimate calibration = runFilter(simulation, options, 80.0, false).calibration;
  std::printf("delay %.2f ms, sigma %.2f\n", 1e3 * calibration.time_offset, 1e3 * calibration.sigma_time_offset);
  EXPECT_NEAR(calibration.time_offset, 0.004, 0.0005);
  EXPECT_LT(calibration.sigma_time_offset, 0.0003);
}

// In slow motion both would be learnt from the gyro's noise: the delay would become -6 ms with a sigma of 0.6 ms, the
// scale -4 % with a sigma of 2.5 %.
TEST(Calibration, LearnsNeitherDelayNorGyroScaleFromNoise) {
  SimulationOptions simulation;
  simulation.image_rate = 30;
  simulation.speed = 0.1;
  simulation.noise_told = 5;
  simulation.noise.gyro_correction_sigma = 0.03;
  double scale_nees = 0;
  constexpr int kRuns = 3;
  for (int seed = 1; seed <= kRuns; ++seed) {
    simulation.seed = seed;
    const CalibrationEstimate calibration = runFilter(simulation, singlePixels(), 60.0, false).calibration;
    EXPECT_NEAR(calibration.time_offset, 0.0, 1e-4);
    EXPECT_GT(calibration.sigma_time_offset, 0.004);
    const Eigen::Array3d scale = calibration.gyro_correction.diagonal().array();
    scale_nees += (scale / calibration.sigma_gyro_correction.diagonal().array()).square().sum() / kRuns;
  }
  std::printf("NEES of the gyro's scale (3) in slow motion: %.2f\n", scale_nees);
  EXPECT_LT(scale_nees, 6.0);
}

// The held delay stays consistent: it is 8 ms, 1.6 sigmas, and the pose covariance accounts for it.
TEST(Calibration, ADelayThatIsHeldIsAllowedFor) {
  SimulationOptions simulation;
  simulation.image_rate = 30;
  simulation.speed = 0.4;
  simulation.noise_told = 5;
  simulation.time_offset = 0.008;
  double nees = 0;
  constexpr int kRuns = 3;
  for (int seed = 1; seed <= kRuns; ++seed) {
    simulation.seed = seed;
    nees += runFilter(simulation, singlePixels(), 30.0, false).nees / kRuns;
  }
  std::printf("NEES with a delay that is held: %.2f\n", nees);
  EXPECT_LT(nees, 9.0);
}

// Extrinsic rotation error of 0.8 degrees while the body hardly rotates: unobservable directions have to keep their
// uncertainty.
TEST(Calibration, IsHonestWhileTheMotionSaysLittle) {
  double nees = 0, believed = 0;
  constexpr int kRuns = 8;
  for (int seed = 1; seed <= kRuns; ++seed) {
    SimulationOptions simulation;
    simulation.seed = seed;
    simulation.speed = 0.25;
    FilterOptions options = singlePixels();
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
    SimulationOptions simulation = exactReadings(seed);
    simulation.depth_offset = 0.01;
    FilterOptions options = singlePixels();
    options.calibration.time_offset = false;  // which so noisy a gyro misleads
    options.calibration.depth_scale = false;  // which takes a part of the offset
    const RunResult run = runFilter(simulation, options, 20.0, false);
    EXPECT_LT(run.calibration.sigma_depth_offset, 0.002);
    EXPECT_NEAR(run.calibration.depth_offset, -0.01, 3 * run.calibration.sigma_depth_offset);
    EXPECT_NEAR(run.most_depth_correction, -0.01, 0.003);
    offset_nees += std::pow((run.calibration.depth_offset + 0.01) / run.calibration.sigma_depth_offset, 2) / kRuns;
    nees += run.nees / kRuns;
    options.calibration.depth_offset = false;
    believed += runFilter(simulation, options, 20.0, false).nees / kRuns;
  }
  std::printf("NEES with depth 1 cm too long: %.2f, of the offset %.2f; depth believed: %.2f\n", nees, offset_nees,
              believed);
  EXPECT_LT(nees, 9.0);
  EXPECT_LT(offset_nees, 2.5);
  EXPECT_GT(believed, nees);
}

/// With the IMU of a phone, whose accelerometer knows how far it went.
SimulationOptions exactMotion(int seed) {
  SimulationOptions simulation = exactReadings(seed);
  simulation.noise.gyro_noise_density = 2e-4;
  simulation.noise.accel_noise_density = 2e-3;
  return simulation;
}

// Held by the accelerometer alone: the pixels fit a world of any size.
TEST(Calibration, FindsTheScaleOfDepth) {
  double nees = 0, believed = 0, own_nees = 0;
  constexpr int kRuns = 6;
  for (int seed = 1; seed <= kRuns; ++seed) {
    SimulationOptions simulation = exactMotion(seed);
    simulation.depth_scale = 1.03;
    FilterOptions options = singlePixels();
    const RunResult run = runFilter(simulation, options, 30.0, false);
    EXPECT_NEAR(run.calibration.depth_scale, 1 / 1.03, 0.01);
    EXPECT_FALSE(run.calibration.depth_contradicts) << "though it did until the scale was known";
    EXPECT_LT(std::abs(run.calibration.depth_offset), 4 * run.calibration.sigma_depth_offset);
    own_nees += std::pow((run.calibration.depth_scale - 1 / 1.03) / run.calibration.sigma_depth_scale, 2) / kRuns;
    nees += run.nees / kRuns;
    options.calibration.depth_scale = false;
    believed += runFilter(simulation, options, 30.0, false).nees / kRuns;
  }
  std::printf("NEES with depth 3 %% too long: %.2f, of the scale %.2f; depth believed: %.2f\n", nees, own_nees,
              believed);
  EXPECT_LT(own_nees, 4.0);
  EXPECT_LT(nees, believed);
}

TEST(Calibration, DepthOfTheRightScaleKeepsIt) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const RunResult run = runFilter(exactMotion(seed), singlePixels(), 30.0, false);
    EXPECT_EQ(run.calibration.depth_scale, 1.0);
    EXPECT_GT(run.calibration.sigma_depth_scale, 0.0);
    EXPECT_LT(run.calibration.sigma_depth_scale, 0.01) << "known, but not to differ";
  }
}

/// Six runs with one wrong number; `own` is its mean squared error in sigmas.
struct Found {
  double nees = 0, believed = 0, own = 0;
};

/// `value` of the number, s, within 2 ms. `sigma`: of the estimate; `flag`: of its state.
Found findsTime(double SimulationOptions::*wrong, double CalibrationEstimate::*estimate,
                double CalibrationEstimate::*sigma, bool CalibrationOptions::*flag, double value) {
  constexpr int kRuns = 6;
  Found found;
  for (int seed = 1; seed <= kRuns; ++seed) {
    SimulationOptions simulation = exactMotion(seed);
    simulation.*wrong = value;
    FilterOptions options = singlePixels();
    const RunResult run = runFilter(simulation, options, 20.0, false);
    EXPECT_NEAR(run.calibration.*estimate, value, 0.002);
    found.own += std::pow((run.calibration.*estimate - value) / run.calibration.*sigma, 2) / kRuns;
    found.nees += run.nees / kRuns;
    options.calibration.*flag = false;
    found.believed += runFilter(simulation, options, 20.0, false).nees / kRuns;
  }
  std::printf("NEES %.2f, of the number %.2f; not estimated: %.2f\n", found.nees, found.own, found.believed);
  return found;
}

// Depth of another moment than the pixels, as a temporal filter in the driver makes it.
TEST(Calibration, FindsTheDelayOfDepth) {
  const Found found = findsTime(&SimulationOptions::depth_delay, &CalibrationEstimate::depth_delay,
                                &CalibrationEstimate::sigma_depth_delay, &CalibrationOptions::depth_delay, 0.02);
  EXPECT_LT(found.own, 4.0);
  EXPECT_LT(found.nees, found.believed);
}

// What the gates cut before it is adopted pulls it towards 0, by about two of its sigmas.
TEST(Calibration, FindsWithinWhatTimeRowsAreRead) {
  const Found found = findsTime(&SimulationOptions::readout, &CalibrationEstimate::readout,
                                &CalibrationEstimate::sigma_readout, &CalibrationOptions::readout, 0.025);
  EXPECT_LT(found.own, 6.0);
  EXPECT_LT(found.nees, found.believed);
}

TEST(Calibration, AGlobalShutterAndDepthOfTheSameMomentStaySo) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const CalibrationEstimate found = runFilter(exactMotion(seed), singlePixels(), 20.0, false).calibration;
    EXPECT_EQ(found.readout, 0.0);
    EXPECT_GT(found.sigma_readout, 0.0);
    EXPECT_LT(found.sigma_readout, 0.001) << "known, but not to differ";
    EXPECT_EQ(found.depth_delay, 0.0);
    EXPECT_GT(found.sigma_depth_delay, 0.0);
    EXPECT_LT(found.sigma_depth_delay, 0.002) << "known, but not to differ";
  }
}

// The estimate varies about zero and must not be passed on.
TEST(Calibration, ExactDepthIsHandedOnAsItIs) {
  for (int seed = 1; seed <= 3; ++seed) {
    SimulationOptions simulation;
    simulation.seed = seed;
    const RunResult run = runFilter(simulation, singlePixels(), 10.0, false);
    EXPECT_GT(run.calibration.sigma_depth_offset, 0.0);
    EXPECT_LT(run.calibration.sigma_depth_offset, 0.004);
    EXPECT_EQ(run.most_depth_correction, 0.0);
  }
}

// A depth image that lies 1.5 pixels left and 0.8 pixels below.
TEST(Calibration, FindsWhereTheDepthImageLies) {
  double nees = 0, believed = 0, own_nees = 0;
  constexpr int kRuns = 6;
  for (int seed = 1; seed <= kRuns; ++seed) {
    SimulationOptions simulation = exactReadings(seed);
    simulation.depth_shift << -0.003, 0.0016;
    FilterOptions options = singlePixels();
    options.calibration.time_offset = false;  // which so noisy a gyro misleads
    const RunResult run = runFilter(simulation, options, 20.0, false);
    EXPECT_LT((run.calibration.depth_shift - simulation.depth_shift).cwiseAbs().maxCoeff(), 3e-4);
    EXPECT_LT((run.depth_shift - simulation.depth_shift).cwiseAbs().maxCoeff(), 4e-4) << "taken";
    own_nees += (run.calibration.depth_shift - simulation.depth_shift)
                    .cwiseQuotient(run.calibration.sigma_depth_shift)
                    .squaredNorm() /
                (2 * kRuns);
    nees += run.nees / kRuns;
    options.calibration.depth_shift = false;
    believed += runFilter(simulation, options, 20.0, false).nees / kRuns;
  }
  std::printf("NEES with depth beside: %.2f, of the shift %.2f; believed: %.2f\n", nees, own_nees, believed);
  EXPECT_LT(nees, 9.0);
  EXPECT_LT(own_nees, 2.5);
  EXPECT_GT(believed, 1.5 * nees);
}

TEST(Calibration, AnExactDepthImageStaysWhereItIs) {
  for (int seed = 1; seed <= 3; ++seed) {
    SimulationOptions simulation;
    simulation.seed = seed;
    simulation.depth_a = 0.001;
    simulation.depth_c = 0.0005;
    const RunResult run = runFilter(simulation, singlePixels(), 20.0, false);
    EXPECT_GT(run.calibration.sigma_depth_shift.minCoeff(), 0.0);
    EXPECT_LT(run.calibration.sigma_depth_shift.maxCoeff(), 4e-4);
    EXPECT_TRUE(run.depth_shift.isZero()) << run.depth_shift.transpose();
  }
}

// A unit of depth that is another one: no scale that would be right is used, but the pose knows how far off it may be.
TEST(Calibration, AScaleBeyondBeliefIsInTheCovariance) {
  for (const double scale : {1.0, 1.5}) {
    SimulationOptions simulation = exactMotion(1);
    simulation.depth_scale = scale;
    const RunResult run = runFilter(simulation, singlePixels(), 20.0, false);
    const Eigen::Vector3d displacement =
        run.window.clones.back().T_W_I.t() - LandmarkSimulation(simulation).stateAt(0.2).T_W_I.t();
    const double sigma = std::sqrt(run.covariance_of_scale.block<3, 3>(3, 3).trace()) / displacement.norm();
    EXPECT_LE(sigma, run.calibration.sigma_depth_scale);
    if (scale == 1.0) {
      EXPECT_EQ(run.calibration.depth_scale, 1.0);
      EXPECT_LT(sigma, 0.005);
    } else {
      EXPECT_GT(sigma, 0.02) << "the prior's";
    }
  }
}

// An implausible shift has another cause, such as depth of another camera.
TEST(Calibration, AShiftBeyondBeliefIsTakenBack) {
  SimulationOptions simulation;
  simulation.depth_shift << 0.03, 0.0;
  simulation.depth_a = 0.001;
  simulation.depth_c = 0.0005;
  const RunResult run = runFilter(simulation, singlePixels(), 20.0, false);
  EXPECT_TRUE(run.depth_shift.isZero());
  EXPECT_LT(run.calibration.depth_shift.norm(), 1e-5);
  EXPECT_TRUE(run.calibration.depth_contradicts);
}

TEST(Calibration, AnOffsetBeyondBeliefIsTakenBack) {
  for (int seed = 1; seed <= 3; ++seed) {
    for (const double speed : {0.3, 1.0}) {
      SimulationOptions simulation = exactReadings(seed);
      simulation.speed = speed;
      simulation.depth_offset = speed < 1 ? 0.04 : 0.03;
      const RunResult run = runFilter(simulation, singlePixels(), 20.0, false);
      EXPECT_TRUE(run.calibration.depth_contradicts);
      EXPECT_EQ(run.calibration.depth_offset, 0.0);
    }
  }
}

// Focal lengths 0.4 % too long, a principal point that is a pixel off.
TEST(Calibration, FindsTheIntrinsics) {
  double nees = 0, believed = 0, own_nees = 0;
  constexpr int kRuns = 6;
  for (int seed = 1; seed <= kRuns; ++seed) {
    SimulationOptions simulation;
    simulation.seed = seed;
    simulation.sigma_px = 0.2;
    simulation.bearing.value << 0.004, 0.0038, 0.002, -0.0015;
    FilterOptions options = singlePixels();
    options.calibration.time_offset = false;  // which so noisy a gyro misleads
    const RunResult run = runFilter(simulation, options, 20.0, false);
    const Eigen::Vector4d off = run.calibration.bearing.value - simulation.bearing.value;
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 0.0015);
    EXPECT_GT(run.most_bearing_correction, 0.003);
    own_nees += off.cwiseQuotient(run.calibration.sigma_bearing).squaredNorm() / kRuns;
    nees += run.nees / kRuns;
    options.calibration.intrinsics = false;
    believed += runFilter(simulation, options, 20.0, false).nees / kRuns;
  }
  std::printf("NEES with wrong intrinsics: %.2f, of the intrinsics %.2f; intrinsics believed: %.2f\n", nees, own_nees,
              believed);
  EXPECT_LT(nees, 9.0);
  EXPECT_LT(own_nees, 8.0);
  EXPECT_GT(believed, 1.5 * nees);
}

TEST(Calibration, ExactIntrinsicsAreHandedOnAsTheyAre) {
  for (int seed = 1; seed <= 3; ++seed) {
    SimulationOptions simulation;
    simulation.seed = seed;
    const RunResult run = runFilter(simulation, singlePixels(), 10.0, false);
    EXPECT_EQ(run.calibration.bearing.value, Eigen::Vector4d::Zero());
    EXPECT_GT(run.calibration.sigma_bearing.minCoeff(), 0.0);
    EXPECT_LT(run.calibration.sigma_bearing.maxCoeff(), 0.002) << "known, but not to differ";
    EXPECT_EQ(run.most_bearing_correction, 0.0);
  }
}

// As when colour and depth are taken at different times: no offset is better than a wrong one.
TEST(Calibration, AnOffsetOfDepthBeyondBeliefIsTakenBack) {
  SimulationOptions simulation;
  simulation.depth_offset = 0.06;
  FilterOptions options = singlePixels();
  const RunResult run = runFilter(simulation, options, 10.0, false);
  EXPECT_TRUE(run.calibration.depth_contradicts);
  EXPECT_NEAR(run.calibration.depth_offset, 0, 1e-4);
  EXPECT_EQ(calibrationDifferences({run.calibration.T_I_C, run.calibration.time_offset}, run.calibration).size(), 1u);
  simulation.depth_offset = 0.01;
  EXPECT_FALSE(runFilter(simulation, options, 10.0, false).calibration.depth_contradicts);
}

TEST(Calibration, StandingTeachesNothing) {
  SimulationOptions simulation;
  simulation.speed = 0;
  simulation.seed = 5;
  const FilterOptions options = singlePixels();
  const RunResult run = runFilter(simulation, options, 60.0, true);
  const Vector6d change = run.window.T_I_C.boxminus(LandmarkSimulation(simulation).T_I_C());
  EXPECT_LT(change.norm(), 0.1 * options.calibration.sigma_rotation);
  EXPECT_LT(std::abs(run.window.time_offset), 0.1 * options.calibration.sigma_time_offset);
  EXPECT_LT(std::abs(run.window.depth_offset), 0.2 * options.calibration.sigma_depth_offset);
}

/// Sigma of the scale of depth after one image, 0.1 s from `t` on, that says it is 1 % off. Rates and accelerations are
/// those of a body at rest; `still`: it is known to be.
double sigmaOfTaughtScale(VioFilter* filter, CloneId id, double t, bool still) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, filter->window().dimension());
  H(0, filter->window().depthScaleColumn()) = 1e4;
  Eigen::VectorXd r = Eigen::VectorXd::Constant(1, 1e4 * 0.01);
  const_cast<SquareRootFilter&>(filter->algebra()).update(H, r);
  const Eigen::Vector3d up(0, 0, 9.81);
  const std::vector<ImuSample> samples{{t, Eigen::Vector3d::Zero(), up}, {t + 0.1, Eigen::Vector3d::Zero(), up}};
  filter->step(filter->predict(samples), id, {}, still ? std::optional(ResidualMotion{0.002, 0.005}) : std::nullopt);
  return filter->calibration().sigma_depth_scale;
}

TEST(Calibration, NothingIsLearntOfScaleAtRestAndLearntAgainAfterAClockThatRanBack) {
  VioFilter filter(singlePixels(), ImuNoise(), SE3(), 0.0, 500, 9.81);
  FilterPrior prior;
  prior.state.t = 100;
  filter.start(prior, 1, Eigen::Vector3d::Zero());
  const double before = filter.calibration().sigma_depth_scale;
  EXPECT_NEAR(sigmaOfTaughtScale(&filter, 2, 100, true), before, 1e-9);
  filter.stop();
  prior.state.t = 0;
  filter.start(prior, 3, Eigen::Vector3d::Zero());
  EXPECT_LT(sigmaOfTaughtScale(&filter, 4, 0, false), 0.9 * before);
}

/// A filter at rest at the origin, whose extrinsic rotation was corrected by `turn` by one measurement.
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
  const FilterOptions options = singlePixels();
  const SE3 given(expSO3(Eigen::Vector3d(0.3, 0.2, 0.1)), Eigen::Vector3d(0.05, 0, 0));
  const Eigen::Vector3d turn(0.006, -0.004, 0.003);
  VioFilter filter = taught(options, given, turn);
  EXPECT_LT((filter.calibration().T_I_C.boxminus(given).head<3>() - turn).norm(), 1e-5);
  EXPECT_GT(filter.calibration().sigma_rotation.minCoeff(), 0);
  filter.stop();
  EXPECT_LT((filter.calibration().T_I_C.boxminus(given).head<3>() - turn).norm(), 1e-5);
  filter.start(FilterPrior(), 9, Eigen::Vector3d::Zero());
  EXPECT_LT((filter.window().T_I_C.boxminus(given).head<3>() - turn).norm(), 1e-5);
  // But with the initial sigma: the estimate may have caused the failure.
  EXPECT_NEAR(filter.calibration().sigma_rotation.x(), options.calibration.sigma_rotation, 1e-6);
}

TEST(Calibration, OfTheGyroOutlivesARestartUnlessItIsBeyondBelief) {
  for (const double off : {-0.02, -0.08}) {
    VioFilter filter(singlePixels(), ImuNoise(), SE3(), 0.0, 500, 9.81);
    filter.start(FilterPrior(), 1, Eigen::Vector3d::Zero());
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, filter.window().dimension());
    H(0, filter.window().gyroColumn() + 1) = 1e6;
    Eigen::VectorXd r = Eigen::VectorXd::Constant(1, 1e6 * off);
    const_cast<SquareRootFilter&>(filter.algebra()).update(H, r);
    EXPECT_NEAR(filter.calibration().gyro_correction(1, 1), off, 1e-5);
    filter.stop();
    filter.start(FilterPrior(), 9, Eigen::Vector3d::Zero());
    Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
    if (off > -0.05) expected(1, 1) = off;
    EXPECT_LT((filter.window().gyro_correction - expected).norm(), 1e-5);
  }
}

// It is corrected for nevertheless, but not what a sensor file should have.
TEST(Calibration, AGyroThatIsWorseThanItsPriorContradicts) {
  ImuNoise noise;
  noise.gyro_correction_sigma = 0.005;
  for (const double off : {-0.015, -0.025}) {
    VioFilter filter(singlePixels(), noise, SE3(), 0.0, 500, 9.81);
    filter.start(FilterPrior(), 1, Eigen::Vector3d::Zero());
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, filter.window().dimension());
    H(0, filter.window().gyroColumn() + 1) = 1e6;
    Eigen::VectorXd r = Eigen::VectorXd::Constant(1, 1e6 * off);
    const_cast<SquareRootFilter&>(filter.algebra()).update(H, r);
    const Eigen::Vector3d up(0, 0, 9.81);
    const std::vector<ImuSample> samples{{0.0, Eigen::Vector3d::Zero(), up}, {0.1, Eigen::Vector3d::Zero(), up}};
    filter.step(filter.predict(samples), 2, {}, std::nullopt);
    EXPECT_NEAR(filter.gyroCorrection()(1, 1), off, 1e-4);
    EXPECT_EQ(filter.calibration().gyro_contradicts, off < -0.02);
  }
}

TEST(Calibration, IsForgottenWhenItWentAstray) {
  const FilterOptions options = singlePixels();
  VioFilter filter = taught(options, SE3(), 6 * options.calibration.sigma_rotation * Eigen::Vector3d::UnitY());
  filter.stop();
  EXPECT_EQ(filter.calibration().T_I_C.matrix(), SE3().matrix());
}

}  // namespace
}  // namespace vip_slam::testing
