// Initialisation at rest and in motion on the landmark simulation; stillness; keyframe selection.
#include <cmath>
#include <random>

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
  std::string reason;
};

/// `scene`: the scene moves with the camera by this share of its motion. `gyro`: scale factor of the gyro. `turned`:
/// error of the configured extrinsic rotation, rad. `learnt`: both are already known.
Start start(double speed, bool depth, double accel_unit = 1, double scene = 0, double gyro = 1, double turned = 0,
            bool learnt = false, double standing_seconds = 1.0) {
  SimulationOptions options;
  options.speed = speed;
  options.depth = depth;
  options.seed = 9;
  LandmarkSimulation simulation(options);
  simulation.generateImu(6.0);
  options.speed = (1 - scene) * speed;
  LandmarkSimulation seen(options);
  seen.generateImu(6.0);
  ImuBuffer imu;
  const SE3 T_I_C = simulation.T_I_C(), given(T_I_C.rotation() * expQuaternion({turned, 0, turned}), T_I_C.t());
  InitialisationOptions initialisation;
  initialisation.standing_seconds = standing_seconds;
  Initialiser initialiser(initialisation, FilterOptions(), options.noise, given, options.focal, 9.81);
  if (learnt) initialiser.setCalibration(T_I_C, (1 / gyro - 1) * Eigen::Matrix3d::Identity());
  std::size_t next = 0;
  Start result;
  for (int k = 0; k < 80 && !result.prior; ++k) {
    result.t = 1.0 + 0.05 * k;
    for (; simulation.imu()[next].t < result.t + 0.01; ++next) {
      ImuSample sample = simulation.imu()[next];
      sample.accel /= accel_unit;
      sample.gyro *= gyro;
      imu.add(sample);
    }
    result.prior = initialiser.add({result.t, seen.sight(result.t, 200)}, imu);
    result.reason = initialiser.reason();
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

TEST(Initialiser, StandingLevelsAndFindsTheGyroBias) {
  const Start s = start(0.0, true);
  ASSERT_TRUE(s.prior);
  EXPECT_LT(s.t, 2.2);
  const NavState truth = truthOf(0.0, s.t);
  EXPECT_TRUE(s.prior->standing);
  EXPECT_LT(tiltError(*s.prior, truth), 0.02);  // an accelerometer bias of 0.04 m/s^2 tilts by 4 mrad per axis
  EXPECT_LT((s.prior->state.bias_gyro - truth.bias_gyro).norm(), 0.005);
  EXPECT_LT(s.prior->state.v_W.norm(), 1e-9);
}

TEST(Initialiser, ALongerRestIsWaitedFor) {
  for (const bool depth : {true, false}) {
    const Start s = start(0.0, depth, 1, 0, 1, 0, false, 3.0);
    ASSERT_TRUE(s.prior) << depth << ' ' << s.reason;
    EXPECT_TRUE(s.prior->standing) << depth;
    EXPECT_GE(s.t, 2.9) << depth;
  }
  const Start moving = start(1.0, true, 1, 0, 1, 0, false, 3.0);  // no rest in the data: it does not wait
  ASSERT_TRUE(moving.prior) << moving.reason;
  EXPECT_LT(moving.t, 2.5);
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

TEST(Initialiser, AnAccelerometerInUnitsOfGravityIsNamed) {
  const Start s = start(0.0, true, 9.80665);
  EXPECT_FALSE(s.prior);
  EXPECT_NE(s.reason.find("reads 1.0"), std::string::npos) << s.reason;
  EXPECT_NE(s.reason.find("unit"), std::string::npos) << s.reason;
}

TEST(Initialiser, MovingFindsVelocityAndGravity) {
  const Start s = start(1.0, true);
  ASSERT_TRUE(s.prior) << s.reason;
  EXPECT_LT(s.t, 3.5);
  const NavState truth = truthOf(1.0, s.t);
  EXPECT_FALSE(s.prior->standing);
  EXPECT_LT(tiltError(*s.prior, truth), 3.0 * s.prior->sigma_tilt);
  EXPECT_LT(tiltError(*s.prior, truth), 0.06);
  // Velocity in the body frame: yaw is free.
  const Eigen::Vector3d estimated = s.prior->state.T_W_I.R().transpose() * s.prior->state.v_W;
  const Eigen::Vector3d expected = truth.T_W_I.R().transpose() * truth.v_W;
  EXPECT_LT((estimated - expected).norm(), 3.0 * s.prior->sigma_velocity);
  EXPECT_LT((estimated - expected).norm(), 0.15);
  EXPECT_LT((s.prior->state.bias_gyro - truth.bias_gyro).norm(), 0.01);
}

// As after a restart in motion: the gyro and extrinsics errors already learnt must not be estimated again as a bias.
TEST(Initialiser, AStartInMotionKnowsWhatWasLearnt) {
  for (const bool learnt : {false, true}) {
    const Start s = start(1.0, true, 1, 0, 1.05, 0.02, learnt);
    if (!learnt && !s.prior) continue;  // rejected: gyro and camera disagree
    ASSERT_TRUE(s.prior) << s.reason;
    const double off = (s.prior->state.bias_gyro - truthOf(1.0, s.t).bias_gyro).norm();
    EXPECT_EQ(learnt, off < 0.01) << off;
  }
}

TEST(Initialiser, WhatMovesBeforeTheCameraIsNoStart) {
  for (const double share : {0.1, 0.2, 0.4}) {
    const Start s = start(1.0, true, 1, share);
    EXPECT_FALSE(s.prior) << share;
    EXPECT_NE(s.reason.find("does something move"), std::string::npos) << s.reason;
  }
}

TEST(Initialiser, MovingWithoutDepthSaysWhyItWaits) {
  const Start s = start(1.0, false);
  EXPECT_FALSE(s.prior);
  EXPECT_NE(s.reason.find("features with depth"), std::string::npos) << s.reason;
}

// During a steady motion the IMU is quiet; when the view changes completely within a second, no feature is shared with
// the oldest image.
TEST(Initialiser, ASteadyMotionIsNoRestHoweverSoonTheViewHasTurnedOver) {
  ImuNoise noise;
  for (const double speed : {0.0, 0.04}) {  // image motion per image, normalised
    ImuBuffer imu;
    Initialiser initialiser(InitialisationOptions(), FilterOptions(), noise, SE3(), 480, 9.81, DepthNoise());
    std::optional<FilterPrior> prior;
    double t = 0;
    for (int k = 0; k < 40 && !prior; ++k) {
      for (; t <= 0.05 * k + 0.01; t += 0.005) imu.add({t, {0, 0, 0}, {0, -9.81, 0}});
      InitialisationInput image{0.05 * k, {}};
      for (int i = 0; i < 100; ++i) {
        FilterMeasurement m;
        m.id = 1000 * (k / 8) + i + 1;  // all tracks are new every 0.4 s
        m.xy = Eigen::Vector2d(0.01 * (i % 10) + speed * (k % 8), 0.01 * (i / 10));
        image.features.push_back(m);
      }
      prior = initialiser.add(image, imu);
    }
    EXPECT_EQ(prior.has_value(), speed == 0.0);
    if (prior) EXPECT_TRUE(prior->standing);
  }
}

// In the dark corners are noise: they last for one image only, or jump at random.
TEST(Initialiser, NoiseIsNoMotion) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-0.3, 0.3), jump(-0.01, 0.01);
  ImuNoise noise;
  for (const int lasts : {1, 4}) {
    ImuBuffer imu;
    Initialiser initialiser(InitialisationOptions(), FilterOptions(), noise, SE3(), 480, 9.81, DepthNoise());
    std::optional<FilterPrior> prior;
    std::vector<FilterMeasurement> corners(80);
    double t = 0;
    for (int k = 0; k < 80 && !prior; ++k) {
      for (; t <= 0.05 * k + 0.01; t += 0.005) imu.add({t, {0, 0, 0}, {0, -9.81, 0}});
      InitialisationInput image{0.05 * k, {}};
      for (int i = 0; i < 80; ++i) {
        const bool fresh = k % lasts == 0;
        corners[i].id = 1 + i + 100 * (k / lasts);
        corners[i].xy = fresh ? Eigen::Vector2d(u(random), u(random))
                              : Eigen::Vector2d(corners[i].xy + Eigen::Vector2d(jump(random), jump(random)));
      }
      image.features = corners;
      prior = initialiser.add(image, imu);
    }
    EXPECT_TRUE(prior && prior->standing) << lasts << ": " << initialiser.reason();
  }
}

// During a slow steady rotation the IMU is quiet, and a bare wall has no features to show the rotation.
TEST(Initialiser, BeforeABareWallTheDepthTellsWhetherItStands) {
  ImuNoise noise;
  for (const double rate : {0.0, 0.05}) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    ImuBuffer imu;
    Initialiser initialiser(InitialisationOptions(), FilterOptions(), noise, SE3(), 480, 9.81, DepthNoise());
    std::optional<FilterPrior> prior;
    double t = 0;
    for (int k = 0; k < 60 && !prior; ++k) {
      for (; t <= 0.05 * k + 0.01; t += 0.005) imu.add({t, {0, rate, 0}, {0, -9.81, 0}});
      InitialisationInput image{0.05 * k, {}};
      image.depth.stride = 16;
      image.depth.cols = 40;
      image.depth.rows = 30;
      const double yaw = rate * image.t_imu;
      for (int i = 0; i < 1200; ++i) {
        const double x = (i % 40 - 19.5) * 16 / 480;
        const double z = 1.0 / (std::cos(yaw) + std::sin(yaw) * x);  // a wall 1 m away
        image.depth.z.push_back(static_cast<float>(z + DepthNoise().sigma(z) * normal(random)));
      }
      prior = initialiser.add(image, imu);
    }
    EXPECT_EQ(prior.has_value(), rate == 0.0);
    if (!prior) EXPECT_NE(initialiser.reason().find("start in motion"), std::string::npos) << initialiser.reason();
  }
}

StillnessCues quiet() {
  StillnessCues cues;
  cues.imu.count = 50;
  cues.imu.gyro_std = 0.002;
  cues.imu.accel_std = 0.03;
  cues.disparity_px = 0.1;
  cues.anchor_disparity_px = 0.1;
  cues.tracks = 100;
  return cues;
}

TEST(Stillness, NeedsImuImageAndSpeedAndHasHysteresis) {
  const ZuptOptions options;
  StillnessDetector detector(options);
  for (int i = 0; i < options.frames_in - 1; ++i) EXPECT_FALSE(detector.update(quiet()));
  EXPECT_TRUE(detector.update(quiet()));
  StillnessCues moving = quiet();
  moving.disparity_px = 5;
  EXPECT_FALSE(detector.update(moving));  // the update is suspended at once ...
  EXPECT_TRUE(detector.still());          // ... the state a little later
  EXPECT_FALSE(detector.update(moving));
  EXPECT_FALSE(detector.still());

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
  StillnessCues tripod = quiet(), sway = quiet(), leaves = quiet();
  tripod.disparity_px = tripod.anchor_disparity_px = 0.02;
  sway.anchor_disparity_px = 0.4;
  leaves.disparity_px = 0.7;
  ASSERT_TRUE(detector.update(tripod));
  EXPECT_LE(detector.residualMotion().translation, 0.25);
  ASSERT_TRUE(detector.update(sway));
  EXPECT_GE(detector.residualMotion().translation, 1.0);
  ASSERT_TRUE(detector.update(leaves));
  EXPECT_GE(detector.residualMotion().translation, 3.0);
  StillnessCues dark = quiet();
  dark.tracks = 0;
  dark.disparity_px = dark.anchor_disparity_px = -1;
  ASSERT_TRUE(detector.update(dark));
  EXPECT_EQ(detector.residualMotion().translation, 1.0);
}

// At 8 m from a wall the image motion of the first 3 cm towards it is no larger than pixel noise at short range.
TEST(Stillness, WhereAllIsFarASmallerImageMotionEndsIt) {
  StillnessDetector detector((ZuptOptions()));
  std::vector<Eigen::Vector3d> near, far;
  for (double x : {-0.5, 0.0, 0.5}) {
    for (double y : {-0.3, 0.3}) {
      near.emplace_back(2 * x, 2 * y, 2);
      far.emplace_back(8 * x, 8 * y, 8);
    }
  }
  StillnessCues begins = quiet(), stands = quiet();
  begins.disparity_px = begins.anchor_disparity_px = 0.3;
  begins.px_per_metre = leastImageMotion(near, 480);
  EXPECT_GT(begins.px_per_metre, 80.0);
  detector.begin(quiet().imu);
  EXPECT_TRUE(detector.update(begins));
  begins.px_per_metre = stands.px_per_metre = leastImageMotion(far, 480);
  EXPECT_TRUE(detector.update(stands));
  EXPECT_GT(detector.residualMotion().translation, 1.0);  // the residual translation is larger, the rotation is not
  EXPECT_LT(detector.residualMotion().rotation, 1.0);
  EXPECT_FALSE(detector.update(begins));
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
