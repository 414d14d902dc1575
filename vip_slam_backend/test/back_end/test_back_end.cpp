// The back end on simulated keyframes: accuracy, invariants after every operation, all variants, bad input by name.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "back_end/simulated_keyframes.h"
#include "vip_slam_backend/back_end.h"
#include "vip_slam_backend/map/culling.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_core/types/camera_correction.h"

using namespace vip_slam;

namespace {

BackEndOptions options(const std::string& variant) {
  BackEndOptions o;
  o.variant = variant;
  o.loop_closing = false;
  o.lockstep = true;
  return o;
}

struct RunResult {
  double rmse = 0, odometry_rmse = 0;
  MapSnapshot snapshot;
};

RunResult run(const BackEndOptions& o, int keyframes, unsigned seed, int points) {
  SimulatedKeyframes world(seed, points);
  BackEnd back_end(o, world.sensor());
  std::map<KeyframeId, double> odometry_error;
  for (int k = 0; k < keyframes; ++k) {
    const KeyframePtr kf = world.next();
    odometry_error[kf->id] = (kf->frame.state.T_W_I.t() - world.truth(kf->frame.t).T_W_I.t()).squaredNorm();
    const MapUpdate update = back_end.addKeyframe(kf);
    EXPECT_EQ(back_end.lastRefusal(), "");
    EXPECT_EQ(update.newest_keyframe, kf->id);
    EXPECT_EQ(checkMap(back_end.map()), "") << "after keyframe " << kf->id;
    back_end.applyPlaneUpdate(world.planes());
    EXPECT_EQ(checkMap(back_end.map()), "") << "after the planes of keyframe " << kf->id;
  }
  back_end.finish();
  EXPECT_EQ(checkMap(back_end.map()), "");
  RunResult result;
  result.snapshot = back_end.snapshot();
  for (const SnapshotKeyframe& kf : result.snapshot.keyframes) {
    result.rmse += (kf.state.T_W_I.t() - world.truth(kf.t).T_W_I.t()).squaredNorm();
    result.odometry_rmse += odometry_error[kf.id];
  }
  result.rmse = std::sqrt(result.rmse / result.snapshot.keyframes.size());
  result.odometry_rmse = std::sqrt(result.odometry_rmse / result.snapshot.keyframes.size());
  return result;
}

RunResult run(const std::string& variant, int keyframes, unsigned seed = 1, const std::string& solver = "structured") {
  BackEndOptions o = options(variant);
  o.solver = solver;
  return run(o, keyframes, seed, 500);
}

/// The keyframe as a front end publishes it that holds the camera's mounting to be off by `error`.
KeyframePtr mountedWrongly(const KeyframePtr& keyframe, const SE3& error) {
  auto wrong = std::make_shared<Keyframe>(*keyframe);
  wrong->frame.T_I_C = keyframe->frame.T_I_C * error;
  const SE3 body = keyframe->frame.T_I_C * wrong->frame.T_I_C.inverse();  // maps the wrong body into the true one
  wrong->frame.state.T_W_I = keyframe->frame.state.T_W_I * body;
  wrong->motion.T_a_b = body.inverse() * keyframe->motion.T_a_b * body;
  return wrong;
}

/// The keyframe of a camera that reads `too_long` m too long, as a front end publishes it that corrects for
/// `correction`.
KeyframePtr readTooLong(const KeyframePtr& keyframe, double too_long, double correction) {
  auto exact = std::make_shared<Keyframe>(*keyframe);
  exact->frame.camera_correction.offset = -too_long;
  return withCameraCorrection(exact, {correction, {}});
}

PlaneUpdate readTooLong(PlaneUpdate update, double too_long, double correction) {
  for (PlaneObservation& o : update.observations) {
    o.camera_correction.offset = -too_long;
    setCameraCorrection({correction, {}}, &o);
  }
  return update;
}

/// Largest error of a keyframe's direction, degrees, after the best common turn about the vertical is taken out.
double worstDirection(const MapSnapshot& snapshot, const SimulatedKeyframes& world) {
  double yaw = 0, worst = 0;
  for (const SnapshotKeyframe& kf : snapshot.keyframes) {
    yaw +=
        yawOf(world.truth(kf.t).T_W_I.rotation() * kf.state.T_W_I.rotation().conjugate()) / snapshot.keyframes.size();
  }
  const Eigen::Quaterniond turn = expQuaternion({0, 0, yaw});
  for (const SnapshotKeyframe& kf : snapshot.keyframes) {
    const Eigen::Quaterniond left = world.truth(kf.t).T_W_I.rotation().conjugate() * (turn * kf.state.T_W_I.rotation());
    worst = std::max(worst, logSO3(left).norm() * 180 / M_PI);
  }
  return worst;
}

}  // namespace

// Round and round in one room, where all keyframes see the same: so many of them stay as are enough.
TEST(BackEnd, KeyframesDoNotCrowd) {
  BackEndOptions crowded = options("vip"), thinned = crowded;
  crowded.culling.enabled = false;
  thinned.culling.above_covisible = 20;
  const RunResult all = run(crowded, 160, 2, 300), few = run(thinned, 160, 2, 300);
  EXPECT_EQ(all.snapshot.keyframes.size(), 160u);
  EXPECT_GT(few.snapshot.keyframes.size(), 40u);
  EXPECT_LT(few.snapshot.keyframes.size(), 100u);
  EXPECT_LT(few.rmse, 1.5 * all.rmse + 0.002);
  // What is kept is spread over the whole time.
  double last = few.snapshot.keyframes.front().t, widest = last;
  for (const SnapshotKeyframe& kf : few.snapshot.keyframes) widest = std::max(widest, kf.t - std::exchange(last, kf.t));
  EXPECT_LT(widest, 30.0);
}

// In a room that is seen again and again all keyframes are ends of loops. Those that tie two odometries stay, as far as
// these need them.
TEST(BackEnd, EndsOfLoopsCrowdOnlyWhereTheyTieParts) {
  BackEndOptions o = options("vip");
  o.culling.enabled = false;
  SimulatedKeyframes world(2, 300);
  BackEnd back_end(o, world.sensor());
  for (int k = 0; k < 90; ++k) {
    back_end.addKeyframe(world.next());
    back_end.applyPlaneUpdate(world.planes());
  }
  CullingOptions culling;
  culling.above_covisible = 20;
  std::vector<KeyframeId> thinned;  // of one odometry
  for (const bool two_odometries : {false, true}) {
    Map map = back_end.map();
    for (KeyframeId id = 1; id <= 90; ++id) map.keyframe(id).loop_keyframe = true;
    // Those that could go are the ends of the oldest loops.
    std::vector<std::pair<KeyframeId, KeyframeId>> loops;
    for (const KeyframeId id : thinned) loops.emplace_back(90, id);
    if (two_odometries) {
      auto other = std::make_shared<Keyframe>(*map.keyframe(90).data);
      other->frame.epoch = 7;
      map.keyframe(90).data = other;
    }
    std::vector<KeyframeId> removed;
    for (int k = 0; k < 40; ++k)
      for (const KeyframeId id : cullKeyframes(culling, 20, ImuNoise(), loops, &map)) removed.push_back(id);
    EXPECT_EQ(checkMap(map), "");
    EXPECT_FALSE(removed.empty());
    if (two_odometries)
      for (std::size_t k = 0; k < 5; ++k) EXPECT_TRUE(map.hasKeyframe(thinned.at(k))) << thinned[k];
    thinned = removed;
  }
}

// The front end learns the mounting in the first keyframes, by halves. What the last one knows holds for all: those at
// the beginning, long fixed, would stay turned by two degrees.
TEST(BackEnd, AMountingLearntOnTheWayHoldsForAllKeyframes) {
  SimulatedKeyframes world(5);
  BackEnd back_end(options("vip"), world.sensor());
  Eigen::Vector3d turn(0.03, -0.02, 0.02);
  for (int k = 0; k < 40; ++k, turn *= 0.5) {
    back_end.addKeyframe(mountedWrongly(world.next(), SE3(expQuaternion(turn), Eigen::Vector3d::Zero())));
    EXPECT_EQ(back_end.lastRefusal(), "");
    EXPECT_EQ(checkMap(back_end.map()), "");
    back_end.applyPlaneUpdate(world.planes());
  }
  back_end.finish();
  EXPECT_LT(worstDirection(back_end.snapshot(), world), 0.3);
}

TEST(BackEnd, AGlobalAdjustmentDoesNotBringBackAnOldMounting) {
  SimulatedKeyframes world(3);
  BackEnd back_end(options("vip"), world.sensor());
  const SE3 error(expQuaternion({0.02, 0.02, -0.02}), Eigen::Vector3d::Zero());
  for (int k = 0; k < 15; ++k) {
    back_end.addKeyframe(mountedWrongly(world.next(), error));
    back_end.applyPlaneUpdate(world.planes());
  }
  back_end.requestGlobalBa();
  const GbaResult solution = back_end.run(back_end.startGlobalBa());
  for (int k = 0; k < 3; ++k) {
    back_end.addKeyframe(world.next());
    back_end.applyPlaneUpdate(world.planes());
  }
  const SE3 T_W_C = back_end.map().keyframe(5).T_W_C();
  const SE3 between = T_W_C.inverse() * back_end.map().keyframe(17).T_W_C();
  back_end.merge(solution);
  EXPECT_EQ(checkMap(back_end.map()), "");
  // Cameras stay where the adjustment has them, to what little it changes.
  const SE3 after = back_end.map().keyframe(5).T_W_C().inverse() * back_end.map().keyframe(17).T_W_C();
  EXPECT_LT(after.boxminus(between).norm(), 0.01);
}

// Depth reads 2 cm too long; the front end knows with the 16th keyframe, and a little better with each further one.
TEST(BackEnd, ADepthCorrectionHoldsForAllKeyframes) {
  SimulatedKeyframes world(4);
  BackEnd back_end(options("vip"), world.sensor());
  std::map<KeyframeId, KeyframePtr> exact;
  double correction = 0;
  const auto worst = [&] {
    double error = 0;
    for (const auto& [id, kf] : back_end.map().keyframes()) {
      for (std::size_t k = 0; k < kf.features().size(); ++k)
        error = std::max(error, std::abs(double(kf.features()[k].depth) - exact[id]->frame.features[k].depth));
      for (const auto& [plane, o] : kf.planes) {
        EXPECT_EQ(o.camera_correction, kf.data->frame.camera_correction);
        const Eigen::Vector4d p_C =
            transformPlane(kf.T_W_C().inverse(), back_end.map().planes().at(plane).estimate.plane).coefficients();
        EXPECT_LT(std::sqrt(p_C.dot(o.G * p_C) / o.G(3, 3)), 0.03);
      }
    }
    return error;
  };
  for (int k = 0; k < 30; ++k) {
    const KeyframePtr kf = exact[k + 1] = world.next();
    const bool knows_now = k == 15;
    if (k >= 15) correction = -0.0205 + 0.0001 * (k - 15) / 3;
    const MapUpdate update = back_end.addKeyframe(readTooLong(kf, 0.02, correction));
    ASSERT_EQ(back_end.lastRefusal(), "");
    EXPECT_EQ(checkMap(back_end.map()), "");
    if (k == 14) EXPECT_NEAR(worst(), 0.02, 1e-4);
    if (knows_now) {
      EXPECT_TRUE(update.global);
      EXPECT_EQ(update.keyframes.size(), back_end.map().keyframes().size());
      for (const KeyframeEstimate& estimate : update.keyframes)
        EXPECT_EQ(estimate.camera_correction.offset, correction);
      EXPECT_LT(worst(), 0.0006);
      EXPECT_TRUE(back_end.globalBaWanted());
      back_end.merge(back_end.run(back_end.startGlobalBa()));
    } else {
      EXPECT_FALSE(back_end.globalBaWanted());
    }
    // Planes may lag behind by what the map knows.
    back_end.applyPlaneUpdate(readTooLong(world.planes(), 0.02, k % 2 ? correction : 0.0));
  }
  back_end.finish();  // with what the newest keyframe knows
  EXPECT_LT(worst(), std::abs(correction + 0.02) + 1e-6);
  double rmse = 0;
  for (const SnapshotKeyframe& kf : back_end.snapshot().keyframes)
    rmse += (kf.state.T_W_I.t() - world.truth(kf.t).T_W_I.t()).squaredNorm() / 30;
  const double known = std::sqrt(rmse);
  const double never_wrong = run("vip", 30, 4).rmse;
  std::printf("rmse %.2f mm, with exact depth %.2f mm\n", 1e3 * known, 1e3 * never_wrong);
  EXPECT_LT(known, never_wrong + 0.001);
}

/// As from a gyro that measures 5 % too much, and what its front end knows of that.
KeyframePtr turningTooFast(const KeyframePtr& keyframe, double correction) {
  auto kf = std::make_shared<Keyframe>(*keyframe);
  for (ImuSample& sample : kf->imu) sample.gyro *= 1.05;
  kf->gyro_correction = correction * Eigen::Matrix3d::Identity();
  return kf;
}

TEST(BackEnd, AGyroCorrectionHoldsForAllKeyframes) {
  const auto rmse = [](bool tells) {
    SimulatedKeyframes world(4);
    BackEnd back_end(options("vip"), world.sensor());
    double correction = 0;
    for (int k = 0; k < 30; ++k) {
      if (tells && k >= 15) correction = 1 / 1.05 - 1 + 1e-5 * (k - 15);
      back_end.addKeyframe(turningTooFast(world.next(), correction));
      EXPECT_EQ(back_end.lastRefusal(), "");
      EXPECT_EQ(checkMap(back_end.map()), "");
      EXPECT_EQ(back_end.globalBaWanted(), tells && k == 15) << k;
      if (back_end.globalBaWanted()) back_end.merge(back_end.run(back_end.startGlobalBa()));
      back_end.applyPlaneUpdate(world.planes());
    }
    back_end.finish();  // with what the newest keyframe knows
    double sum = 0;
    for (const auto& [id, kf] : back_end.map().keyframes()) {
      EXPECT_EQ(kf.gyro_correction(1, 1), correction);
      sum += (kf.state.T_W_I.t() - world.truth(kf.data->frame.t).T_W_I.t()).squaredNorm() / 30;
    }
    return std::sqrt(sum);
  };
  const double known = rmse(true), believed = rmse(false), exact = run("vip", 30, 4).rmse;
  std::printf("rmse %.2f mm, with an exact gyro %.2f, the gyro believed %.2f mm\n", 1e3 * known, 1e3 * exact,
              1e3 * believed);
  EXPECT_LT(known, exact + 0.001);
  EXPECT_GT(believed, exact + 0.001);
}

TEST(BackEnd, AGlobalAdjustmentOfAGyroAsItMeasuredIsDoneAgain) {
  SimulatedKeyframes world(3);
  BackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 12; ++k) back_end.addKeyframe(turningTooFast(world.next(), 0));
  const GbaResult before = back_end.run(back_end.startGlobalBa());
  back_end.addKeyframe(turningTooFast(world.next(), -0.048));
  back_end.startGlobalBa();
  EXPECT_FALSE(back_end.merge(before).global);
  EXPECT_TRUE(back_end.globalBaWanted());
}

// Focal lengths 0.4 % too long, a principal point that is a pixel off; the front end knows from the 15th keyframe on.
TEST(BackEnd, IntrinsicsThatAreKnownBetterHoldForAllKeyframes) {
  SimulatedKeyframes world(4);
  BackEnd back_end(options("vip"), world.sensor());
  const BearingCorrection bearing{{0.004, 0.004, 0.002, -0.001}};
  std::map<KeyframeId, KeyframePtr> exact;
  const auto worst = [&] {
    double error = 0;
    for (const auto& [id, kf] : back_end.map().keyframes()) {
      for (std::size_t k = 0; k < kf.features().size(); ++k)
        error = std::max(error, double((kf.features()[k].xy - exact[id]->frame.features[k].xy).cwiseAbs().maxCoeff()));
    }
    return error;
  };
  for (int k = 0; k < 30; ++k) {
    const KeyframePtr kf = exact[k + 1] = world.next();
    // What this camera sees, and what of it is corrected for by now.
    auto seen = std::make_shared<Keyframe>(*kf);
    seen->frame.camera_correction.bearing = bearing;
    const MapUpdate update =
        back_end.addKeyframe(withCameraCorrection(seen, {0, {}, k >= 15 ? bearing : BearingCorrection()}));
    ASSERT_EQ(back_end.lastRefusal(), "");
    EXPECT_EQ(checkMap(back_end.map()), "");
    if (k == 14) EXPECT_GT(worst(), 0.002);
    if (k != 15) continue;
    EXPECT_TRUE(update.global);
    EXPECT_TRUE(back_end.globalBaWanted());
    for (const KeyframeEstimate& estimate : update.keyframes) EXPECT_EQ(estimate.camera_correction.bearing, bearing);
    EXPECT_LT(worst(), 1e-6);
  }
  EXPECT_LT(worst(), 1e-6);
}

TEST(BackEnd, AGlobalAdjustmentOfDepthAsItWasReadIsDoneAgain) {
  SimulatedKeyframes world(3);
  BackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 12; ++k) back_end.addKeyframe(readTooLong(world.next(), 0.02, 0));
  const GbaResult before = back_end.run(back_end.startGlobalBa());
  back_end.addKeyframe(readTooLong(world.next(), 0.02, -0.02));
  back_end.startGlobalBa();
  EXPECT_FALSE(back_end.merge(before).global);
  EXPECT_TRUE(back_end.globalBaWanted());
}

TEST(BackEnd, ARequestOutlivesAResultThatComesTooLate) {
  SimulatedKeyframes world(3);
  BackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 4; ++k) back_end.addKeyframe(world.next());
  back_end.requestGlobalBa();
  GbaResult of_nothing;
  of_nothing.correction = 1000;
  back_end.merge(of_nothing);
  EXPECT_TRUE(back_end.globalBaWanted());
}

// Also where a stored map has a keyframe by the number of its predecessor.
TEST(BackEnd, ANewOdometryBringsItsOwnBiases) {
  SimulatedKeyframes world(3);
  BackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 6; ++k) back_end.addKeyframe(world.next());
  auto anew = std::make_shared<Keyframe>(*world.next());
  anew->frame.epoch = 1;
  anew->frame.features.clear();
  anew->frame.state.bias_gyro = Eigen::Vector3d(0.05, -0.02, 0.01);
  back_end.addKeyframe(anew);
  ASSERT_EQ(back_end.lastRefusal(), "");
  EXPECT_LT((back_end.map().keyframe(7).state.bias_gyro - anew->frame.state.bias_gyro).norm(), 1e-6);
}

TEST(BackEnd, AllVariantsBeatTheOdometry) {
  for (const char* variant : {"vi", "vi_p", "vi_cp", "vip"}) {
    const RunResult result = run(variant, variant == std::string("vi_p") ? 20 : 45);
    EXPECT_LT(result.rmse, 0.01) << variant;
    EXPECT_LT(result.rmse, 0.5 * result.odometry_rmse) << variant;
    EXPECT_GT(result.snapshot.landmarks.size(), 50u) << variant;
    RecordProperty(variant, std::to_string(result.rmse));
    std::printf(
        "%s: rmse %.4f m, odometry %.4f m, %zu keyframes, %zu landmarks, reobserved %lu merged %lu outliers %lu\n",
        variant, result.rmse, result.odometry_rmse, result.snapshot.keyframes.size(), result.snapshot.landmarks.size(),
        static_cast<unsigned long>(result.snapshot.statistics.reobserved),
        static_cast<unsigned long>(result.snapshot.statistics.merged),
        static_cast<unsigned long>(result.snapshot.statistics.outliers));
  }
}

// Where few landmarks live from one keyframe to the next, what the odometry knows of the images in between counts.
TEST(BackEnd, OdometryHoldsWhereLandmarksAreFew) {
  double with = 0, without = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    BackEndOptions o = options("vi");
    with += run(o, 40, seed, 8).rmse;
    o.measurement.use_odometry = false;
    without += run(o, 40, seed, 8).rmse;
  }
  std::printf("mean rmse of four seeds: %.4f m, without odometry %.4f m\n", with / 4, without / 4);
  EXPECT_LT(with, 0.7 * without);
}

TEST(BackEnd, TwoRunsGiveTheSameBits) {
  const RunResult a = run("vip", 15), b = run("vip", 15);
  ASSERT_EQ(a.snapshot.keyframes.size(), b.snapshot.keyframes.size());
  for (std::size_t k = 0; k < a.snapshot.keyframes.size(); ++k)
    EXPECT_EQ(a.snapshot.keyframes[k].state.T_W_I.matrix(), b.snapshot.keyframes[k].state.T_W_I.matrix());
}

TEST(BackEnd, CeresRunsTheSameSystem) {
  const RunResult a = run("vip", 12), b = run("vip", 12, 1, "ceres");
  EXPECT_NEAR(a.rmse, b.rmse, 2e-3);
}

TEST(BackEnd, GlobalAdjustmentMergesWithWhatCameMeanwhile) {
  SimulatedKeyframes world(3);
  BackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 15; ++k) {
    back_end.addKeyframe(world.next());
    back_end.applyPlaneUpdate(world.planes());
  }
  back_end.requestGlobalBa();
  EXPECT_TRUE(back_end.globalBaWanted());
  const GbaJob job = back_end.startGlobalBa();
  EXPECT_FALSE(back_end.globalBaWanted());
  for (int k = 0; k < 5; ++k) {
    back_end.addKeyframe(world.next());
    back_end.applyPlaneUpdate(world.planes());
  }
  const MapUpdate update = back_end.merge(back_end.run(job));
  EXPECT_TRUE(update.global);
  EXPECT_EQ(checkMap(back_end.map()), "");
  EXPECT_EQ(update.keyframes.size(), back_end.map().keyframes().size());
  for (const KeyframeEstimate& kf : update.keyframes)
    EXPECT_LT((kf.state.T_W_I.t() - world.truth((kf.id - 1) * world.interval()).T_W_I.t()).norm(), 0.03);
  // map -> odom carries the newest keyframe.
  const MapKeyframe& newest = back_end.map().keyframe(update.newest_keyframe);
  EXPECT_LT((update.T_map_odom * newest.data->frame.state.T_W_I).boxminus(newest.state.T_W_I).norm(), 1e-9);
}

TEST(BackEnd, BadInputIsRefusedByName) {
  SimulatedKeyframes world(5);
  BackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 4; ++k) {
    back_end.addKeyframe(world.next());
    back_end.applyPlaneUpdate(world.planes());
  }
  const KeyframePtr good = world.next();
  const auto refusalOf = [&](const Keyframe& kf) {
    const std::size_t before = back_end.map().keyframes().size();
    const MapUpdate update = back_end.addKeyframe(std::make_shared<Keyframe>(kf));
    EXPECT_EQ(back_end.map().keyframes().size(), before);
    EXPECT_TRUE(update.keyframes.empty());
    EXPECT_EQ(checkMap(back_end.map()), "");
    return back_end.lastRefusal();
  };
  Keyframe bad = *good;
  bad.frame.features[3].xy.x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(refusalOf(bad).find("feature 3 is not finite"), std::string::npos);
  bad = *good;
  bad.frame.state.v_W.y() = std::numeric_limits<double>::infinity();
  EXPECT_NE(refusalOf(bad).find("state is not finite"), std::string::npos);
  bad = *good;
  bad.id = 2;
  EXPECT_NE(refusalOf(bad).find("not newer"), std::string::npos);
  bad = *good;
  bad.imu[4].gyro.x() = std::nan("");
  EXPECT_NE(refusalOf(bad).find("IMU sample 4"), std::string::npos);
  bad = *good;
  bad.motion.T_a_b.t().z() = std::nan("");
  EXPECT_NE(refusalOf(bad).find("odometry's motion"), std::string::npos);
  bad = *good;
  bad.motion.covariance(2, 2) = -1e-6;
  EXPECT_NE(refusalOf(bad).find("odometry's motion"), std::string::npos);
  for (const double wrong : {std::nan(""), 0.5}) {
    bad = *good;
    bad.frame.camera_correction.bearing.value(2) = wrong;
    EXPECT_NE(refusalOf(bad).find("camera's correction"), std::string::npos) << wrong;
  }
  bad = *good;
  bad.frame.camera_correction.offset = std::nan("");
  EXPECT_NE(refusalOf(bad).find("camera's correction"), std::string::npos);
  bad = *good;
  bad.frame.t = 0.1;
  EXPECT_NE(refusalOf(bad).find("not after"), std::string::npos);
  EXPECT_EQ(back_end.addKeyframe(nullptr).keyframes.size(), 0u);
  EXPECT_NE(back_end.lastRefusal().find("no keyframe"), std::string::npos);
  // A good one still enters afterwards.
  back_end.addKeyframe(good);
  EXPECT_EQ(back_end.lastRefusal(), "");
}

TEST(BackEnd, SurvivesPoorKeyframes) {
  SimulatedKeyframes world(6);
  BackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 12; ++k) {
    Keyframe kf = *world.next();
    if (k == 4 || k == 5) kf.frame.features.clear();        // no points
    if (k == 7) kf.imu.clear();                             // a gap in the IMU
    if (k == 9) kf.frame.features.clear(), kf.imu.clear();  // neither
    back_end.addKeyframe(std::make_shared<Keyframe>(kf));
    EXPECT_EQ(back_end.lastRefusal(), "") << k;
    EXPECT_EQ(checkMap(back_end.map()), "") << k;
    PlaneUpdate planes = world.planes();
    if (k == 6) {
      PlaneEstimate through_origin;  // seen once, through the world origin
      through_origin.id = 50;
      through_origin.plane = Plane(Eigen::Vector3d(1, 2, 0.1), 0.0);
      planes.planes.push_back(through_origin);
      PlaneObservation once;
      once.keyframe = kf.id;
      once.plane = 50;
      once.G = 100 * Eigen::Matrix4d::Identity();
      once.points.push_back({Eigen::Vector3f(0, 0, 1), 0.1f});
      planes.observations.push_back(once);
      PlaneEstimate broken;
      broken.id = 51;
      broken.plane.d = std::nan("");
      planes.planes.push_back(broken);
      once.plane = 77;  // unknown plane
      planes.observations.push_back(once);
      planes.associated.emplace_back(12345678, 50);  // unknown landmark
    }
    back_end.applyPlaneUpdate(planes);
    EXPECT_EQ(checkMap(back_end.map()), "") << k;
    EXPECT_FALSE(back_end.map().hasPlane(51));
  }
  back_end.finish();
  EXPECT_EQ(checkMap(back_end.map()), "");
  for (const auto& entry : back_end.map().keyframes())
    EXPECT_LT((entry.second.state.T_W_I.t() - world.truth(entry.second.data->frame.t).T_W_I.t()).norm(), 0.1);
}
