// SPDX-License-Identifier: BSD-3-Clause
// Starts at rest and in motion on the landmark simulation; stillness; keyframe selection.
#include <cmath>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "landmark_simulation.h"
#include "vip_slam_frontend/filter/zero_velocity.h"
#include "vip_slam_frontend/initialisation/initialiser.h"
#include "vip_slam_frontend/keyframes/keyframe_selector.h"

namespace vip_slam::testing {
namespace {

struct Start {
  std::optional<FilterPrior> prior;
  double t = 0;
  std::string reason, accelerometer_fault;
  frontend::Level level = frontend::Level::kAccelerometer;
};

struct StartOptions {
  double speed = 1;  ///< m/s; 0: at rest
  int points = 50;   ///< with depth
  bool surfaces = false;
  bool motion = true;     ///< images tell the motion between them
  double accel_unit = 1;  ///< m/s^2 of what the accelerometer calls one
  double gyro_bias = 0;   ///< rad/s, beyond the simulation's, about x
  bool gyro = true, accel = true;
  std::optional<Eigen::Vector3d> up;  ///< by a floor, in the camera
};

Start start(const StartOptions& o) {
  SimulationOptions options;
  options.speed = o.speed;
  options.seed = 9;
  LandmarkSimulation simulation(options);
  simulation.generateImu(6.0);
  SensorConfig sensor;
  sensor.topics.imu = o.gyro && o.accel ? "imu" : "";
  sensor.topics.gyro = o.gyro && !o.accel ? "gyro" : "";
  sensor.topics.accel = o.accel && !o.gyro ? "accel" : "";
  frontend::InertialInput inertial(sensor, 0.1);
  const SE3 T_I_C = simulation.T_I_C();
  Initialiser initialiser(InitialisationOptions(), FilterOptions(), options.noise, T_I_C, 9.81);
  std::size_t next = 0;
  Start result;
  std::optional<SE3> T_W_C_before;
  for (int k = 0; k < 80 && !result.prior; ++k) {
    result.t = 1.0 + 0.05 * k;
    for (; simulation.imu()[next].t < result.t + 0.01; ++next) {
      ImuSample sample = simulation.imu()[next];
      sample.accel /= o.accel_unit;
      sample.gyro.x() += o.gyro_bias;
      if (o.gyro && o.accel) inertial.addImu(sample);
      if (o.gyro && !o.accel) inertial.addGyro(sample.t, sample.gyro);
      if (o.accel && !o.gyro) inertial.addAccel(sample.t, sample.accel);
    }
    InitialisationInput image{result.t, o.points, o.surfaces, o.up, std::nullopt};
    const SE3 T_W_C = simulation.stateAt(result.t).T_W_I * T_I_C;
    if (o.motion && T_W_C_before) image.T_current_previous = T_W_C.inverse() * *T_W_C_before;
    T_W_C_before = T_W_C;
    result.prior = initialiser.add(image, inertial);
    result.reason = initialiser.reason();
    result.accelerometer_fault = initialiser.accelerometerFault();
    result.level = initialiser.level();
  }
  return result;
}

double tiltError(const FilterPrior& prior, const NavState& truth) {
  const Eigen::Vector3d a = prior.state.T_W_I.R().transpose() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d b = truth.T_W_I.R().transpose() * Eigen::Vector3d::UnitZ();
  return std::acos(std::min(1.0, a.dot(b)));
}

NavState truthOf(double speed, double t) {
  SimulationOptions options;
  options.speed = speed;
  options.seed = 9;
  LandmarkSimulation simulation(options);
  simulation.generateImu(6.0);
  return simulation.stateAt(t);
}

/// Error of the velocity in the body frame, m/s: yaw is free.
double velocityError(const FilterPrior& prior, const NavState& truth) {
  return (prior.state.T_W_I.R().transpose() * prior.state.v_W - truth.T_W_I.R().transpose() * truth.v_W).norm();
}

TEST(Initialiser, StartsWithinHalfASecondMovingOrStillWithSigmasThatHold) {
  for (const double speed : {0.0, 1.0}) {
    for (const bool surfaces : {false, true}) {
      StartOptions options;
      options.speed = speed;
      options.surfaces = surfaces;
      options.points = surfaces ? 0 : 8;
      const Start s = start(options);
      ASSERT_TRUE(s.prior) << speed << ' ' << s.reason;
      EXPECT_LT(s.t, 1.3);
      const NavState truth = truthOf(speed, s.t);
      // Level by the mean force: its error over gravity is the tilt's.
      const double sigma_tilt = std::hypot(s.prior->sigma_mean_accel, s.prior->sigma_bias_accel) / 9.81;
      EXPECT_LT(tiltError(*s.prior, truth), 3 * sigma_tilt);
      EXPECT_LT(velocityError(*s.prior, truth), 3 * s.prior->sigma_velocity);
      EXPECT_LT((s.prior->state.bias_gyro - truth.bias_gyro).norm(), 3 * s.prior->sigma_bias_gyro);
      EXPECT_FALSE(s.prior->at_rest);
    }
  }
}

TEST(Initialiser, AVelocityThatNothingTellsIsWide) {
  StartOptions options;
  options.motion = false;
  const Start s = start(options);
  ASSERT_TRUE(s.prior) << s.reason;
  EXPECT_LT(velocityError(*s.prior, truthOf(1.0, s.t)), 3 * s.prior->sigma_velocity);
}

TEST(Initialiser, AGyroBiasBeyondItsPriorShowsAgainstTheImages) {
  StartOptions options;
  options.speed = 0.3;
  options.gyro_bias = 0.15;
  const Start s = start(options);
  ASSERT_TRUE(s.prior) << s.reason;
  const Eigen::Vector3d truth = truthOf(0.3, s.t).bias_gyro + Eigen::Vector3d(0.15, 0, 0);
  EXPECT_LT((s.prior->state.bias_gyro - truth).norm(), 3 * s.prior->sigma_bias_gyro);
}

TEST(Initialiser, WithoutAnAccelerometerTheCameraIsLevel) {
  for (const bool gyro : {false, true}) {
    StartOptions options;
    options.accel = false;
    options.gyro = gyro;
    const Start s = start(options);
    ASSERT_TRUE(s.prior) << s.reason;
    SimulationOptions simulated;
    const Eigen::Vector3d down_I = LandmarkSimulation(simulated).T_I_C().R() * Eigen::Vector3d::UnitY();
    EXPECT_LT((s.prior->state.T_W_I.rotation() * down_I + Eigen::Vector3d::UnitZ()).norm(), 1e-9);
    EXPECT_LT(s.prior->sigma_tilt, 0.001);  // part of the gauge
  }
}

// Patches of planes as the camera sees them, `count` of each.
std::vector<SurfacePatch> planes(const std::vector<std::pair<Eigen::Vector3d, int>>& normals) {
  std::vector<SurfacePatch> all;
  for (std::size_t k = 0; k < normals.size(); ++k) {
    SurfacePatch patch;
    patch.n_C = normals[k].first.normalized();
    patch.surface = static_cast<int>(k);
    all.insert(all.end(), static_cast<std::size_t>(normals[k].second), patch);
  }
  return all;
}

TEST(Initialiser, AFloorInViewIsLevel) {
  const Eigen::Vector3d floor = Eigen::Vector3d(0.1, -0.7, -0.7).normalized(), wall(0.1, 0.5, -0.85);
  const auto up = frontend::upByFloor(planes({{wall, 200}, {floor, 60}, {floor + Eigen::Vector3d(0, 0, 0.2), 30}}));
  ASSERT_TRUE(up);
  EXPECT_LT((*up - floor).norm(), 1e-12);
  EXPECT_FALSE(frontend::upByFloor(planes({{wall, 200}, {floor, 10}})));   // too small
  EXPECT_FALSE(frontend::upByFloor(planes({{wall, 200}, {-floor, 60}})));  // a ceiling may be a wall
  EXPECT_FALSE(frontend::upByFloor({}));

  StartOptions options;
  options.accel = options.gyro = false;
  options.up = up;
  const Start s = start(options);
  ASSERT_TRUE(s.prior) << s.reason;
  const Eigen::Vector3d up_I = LandmarkSimulation(SimulationOptions()).T_I_C().R() * floor;
  EXPECT_LT((s.prior->state.T_W_I.rotation() * up_I - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
}

TEST(Initialiser, AnAccelerometerAloneLevels) {
  StartOptions options;
  options.gyro = false;
  options.speed = 0;
  const Start s = start(options);
  ASSERT_TRUE(s.prior) << s.reason;
  EXPECT_LT(tiltError(*s.prior, truthOf(0, s.t)), 0.03);
}

TEST(Initialiser, BlindItStartsAtRestOnly) {
  StartOptions options;
  options.points = 3;
  options.motion = false;
  options.speed = 0;
  const Start rest = start(options);
  ASSERT_TRUE(rest.prior) << rest.reason;
  EXPECT_TRUE(rest.prior->at_rest);
  EXPECT_LT(tiltError(*rest.prior, truthOf(0.0, rest.t)), 0.02);
  options.speed = 1;
  const Start moving = start(options);
  EXPECT_FALSE(moving.prior);
  EXPECT_NE(moving.reason.find("sees 3 points with depth and no surfaces, needs 8"), std::string::npos)
      << moving.reason;
}

TEST(Initialiser, TheRobotBeginsAtTheOriginHeadingAlongX) {
  // A camera's IMU mounted on a robot: x right, y down, z forward; half a metre up and ahead, tilted.
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const SE3 T_base_imu(Eigen::Quaterniond(R) * expQuaternion({0.2, 0, 0}), {0.3, 0, 0.5});
  const Eigen::Vector3d up_imu = T_base_imu.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  FilterPrior prior;
  prior.state.T_W_I = SE3(gravityAlignedRotation(up_imu), Eigen::Vector3d::Zero());
  prior.state.v_W = prior.state.T_W_I.rotation() * (T_base_imu.rotation().conjugate() * Eigen::Vector3d::UnitX());
  startAtBase(T_base_imu, &prior);
  EXPECT_LT((prior.state.T_W_I * T_base_imu.inverse()).boxminus(SE3()).norm(), 1e-9);
  EXPECT_LT((prior.state.v_W - Eigen::Vector3d::UnitX()).norm(), 1e-9);
  EXPECT_LT((prior.state.T_W_I.rotation() * up_imu - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
}

// Images carry the start then; up is where the camera, or a floor in view, says.
TEST(Initialiser, AnAccelerometerInUnitsOfGravityIsNamedAndNotUsed) {
  StartOptions options;
  options.speed = 0;
  options.accel_unit = 9.80665;
  const Start s = start(options);
  ASSERT_TRUE(s.prior);
  EXPECT_FALSE(s.prior->standing);
  EXPECT_EQ(s.level, frontend::Level::kCamera);
  EXPECT_NE(s.accelerometer_fault.find("reads 1.0"), std::string::npos) << s.accelerometer_fault;
  EXPECT_NE(s.accelerometer_fault.find("unit"), std::string::npos) << s.accelerometer_fault;
  options.up = Eigen::Vector3d(0, -1, 0);
  EXPECT_EQ(start(options).level, frontend::Level::kFloor);
  options.accel_unit = 1;
  const Start sound = start(options);
  EXPECT_TRUE(sound.accelerometer_fault.empty()) << sound.accelerometer_fault;
  EXPECT_EQ(sound.level, frontend::Level::kAccelerometer);
}

StillnessCues quiet() {
  StillnessCues cues;
  cues.imu.count = 50;
  cues.imu.gyro_std = 0.002;
  cues.imu.accel_std = 0.03;
  cues.disparity_px = 0.1;
  cues.anchor_disparity_px = 0.1;
  cues.tracks = 100;
  cues.sigma_px = 0.1;
  cues.px_per_radian = 480;
  cues.px_per_metre = 100;
  return cues;
}

TEST(Stillness, NeedsImuImageAndSpeed) {
  const ZuptOptions options;
  StillnessDetector detector(options);
  EXPECT_TRUE(detector.update(quiet()));
  StillnessCues moving = quiet();
  moving.disparity_px = 5;
  EXPECT_FALSE(detector.update(moving));
  EXPECT_TRUE(detector.imuRests()) << "something moves before a camera that stands";

  // A wall that moves with the camera: the image is at rest, the IMU is not.
  StillnessCues wall = quiet();
  wall.imu.accel_std = 1.0;
  // Even flight past a distant view: IMU quiet, image quiet, but the estimate moves.
  StillnessCues glide = quiet();
  glide.speed = 0.5;
  StillnessCues dark = quiet();
  dark.tracks = 3;
  for (const StillnessCues& cues : {wall, glide, dark}) {
    detector.reset();
    for (int i = 0; i < 20; ++i) EXPECT_FALSE(detector.update(cues));
  }
}

// Between the first image of a motion and its detection, zero velocity must not be claimed with millimetre accuracy.
TEST(Stillness, IsAsExactAsTheImagesAreQuiet) {
  const ZuptOptions options;
  StillnessDetector detector(options);
  detector.begin(quiet().imu);
  StillnessCues tripod = quiet(), sway = quiet();
  tripod.disparity_px = tripod.anchor_disparity_px = 0.02;
  sway.anchor_disparity_px = 0.4;
  ASSERT_TRUE(detector.update(tripod));
  const double noise = tripod.sigma_px / std::sqrt(static_cast<double>(tripod.tracks));  // of a mean over the tracks
  EXPECT_NEAR(detector.residualMotion().translation, std::hypot(0.02, noise) / 100, 1e-9);
  ASSERT_TRUE(detector.update(sway));
  EXPECT_NEAR(detector.residualMotion().translation, std::hypot(0.4, noise) / 100, 1e-9);
  EXPECT_NEAR(detector.residualMotion().rotation, std::hypot(0.4, noise) / 480, 1e-9);
  StillnessCues dark = quiet();
  dark.tracks = 0;
  dark.disparity_px = dark.anchor_disparity_px = -1;
  ASSERT_TRUE(detector.update(dark));
  EXPECT_GT(detector.residualMotion().translation, std::hypot(0.4, noise) / 100);
}

// Translation along the viewing direction moves a point in proportion to its distance from the image centre;
// translation across it moves all points.
TEST(Stillness, ImageMotionOfATranslationIsLeastAlongTheView) {
  EXPECT_NEAR(leastImageMotion({{1, 0, 4}, {-1, 0, 4}, {0, 1, 4}, {0, -1, 4}}, 480), 480 / 4.0 * 0.25, 1e-9);
  EXPECT_EQ(leastImageMotion({}, 480), 0);
}

TEST(Stillness, AStartAtRestBeforeABareWallLastsUntilTheImuShowsAMotion) {
  const ZuptOptions options;
  StillnessDetector detector(options);
  StillnessCues blind = quiet();
  blind.tracks = 0;
  blind.disparity_px = -1;
  blind.imu.mean_gyro = {0.01, -0.02, 0.005};
  blind.imu.mean_accel = {0.3, -9.7, 0.2};
  EXPECT_FALSE(detector.update(blind));  // no features and no calibrated rest
  detector.begin(blind.imu);
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(detector.update(blind));
    blind.imu.mean_accel.x() += 0.0003;  // a random-walk bias
  }
  StillnessCues leaves = blind, turns = blind;
  leaves.imu.mean_accel.z() += 0.12;
  turns.imu.mean_gyro.y() += 0.01;
  for (const StillnessCues& cues : {leaves, turns}) {
    detector.begin(blind.imu);
    EXPECT_FALSE(detector.update(cues));
  }
}

std::vector<Feature> features(double shift) {
  std::vector<Feature> list;
  for (int i = 0; i < 100; ++i) {
    Feature f;
    f.id = i + 1;
    f.xy = Eigen::Vector2f(0.01f * (i % 10) + static_cast<float>(shift), 0.01f * (i / 10));
    f.depth = 2.0f;
    list.push_back(f);
  }
  return list;
}

TEST(KeyframeSelector, ChoosesByEachCriterionAndNeverWhileStill) {
  const KeyframeOptions options;
  KeyframeSelector selector(options);
  EXPECT_EQ(selector.decide(0, SE3(), features(0), 500, false), "first");
  selector.accept(0, SE3(), features(0));
  EXPECT_EQ(selector.decide(0.5, SE3(), features(0), 500, false), "");
  EXPECT_EQ(selector.decide(0.5, SE3(), features(0.08), 500, false), "parallax");
  EXPECT_EQ(selector.decide(0.05, SE3(), features(0.08), 500, false), "");
  EXPECT_EQ(selector.decide(0.5, SE3(), features(0.08), 500, true), "");
  EXPECT_EQ(selector.decide(2.0, SE3(), features(0), 500, false), "time");
  EXPECT_EQ(selector.decide(200.0, SE3(), features(0), 500, true), "");
  const SE3 turned(expQuaternion(Eigen::Vector3d(0, 0.3, 0)), Eigen::Vector3d::Zero());
  EXPECT_EQ(selector.decide(0.5, turned, features(0), 500, false), "rotation");
  const SE3 shifted(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.3, 0, 0));
  EXPECT_EQ(selector.decide(0.5, shifted, features(0), 500, false), "translation");
  std::vector<Feature> few = features(0);
  few.resize(50);
  EXPECT_EQ(selector.decide(0.5, SE3(), few, 500, false), "tracked ratio");
}

}  // namespace
}  // namespace vip_slam::testing
