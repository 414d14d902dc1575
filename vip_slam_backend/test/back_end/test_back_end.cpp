// The back end on simulated keyframes: accuracy, invariants after every operation, all variants, bad input by name.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "back_end/back_end_runs.h"
#include "vip_slam_backend/map/culling.h"
#include "vip_slam_backend/map/map.h"

using namespace vip_slam;

// Many rounds in one room, where all keyframes see the same: only as many stay as are needed.
TEST(BackEnd, KeyframesDoNotCrowd) {
  BackEndOptions crowded = options("vip"), thinned = crowded;
  crowded.culling.enabled = false;
  thinned.culling.above_covisible = 20;
  const RunResult all = run(crowded, 160, 2, 300), few = run(thinned, 160, 2, 300);
  EXPECT_EQ(all.snapshot.keyframes.size(), 160u);
  EXPECT_GT(few.snapshot.keyframes.size(), 40u);
  EXPECT_LT(few.snapshot.keyframes.size(), 100u);
  EXPECT_LT(few.rmse, 1.5 * all.rmse + 0.002);
  // The kept keyframes are spread over the whole time.
  double last = few.snapshot.keyframes.front().t, widest = last;
  for (const SnapshotKeyframe& kf : few.snapshot.keyframes) widest = std::max(widest, kf.t - std::exchange(last, kf.t));
  EXPECT_LT(widest, 30.0);
}

// In a room that is revisited many times all keyframes are ends of loops. Only loops that tie two odometries protect
// their keyframes, as far as these need them.
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
    // The keyframes that could be culled are the ends of the oldest loops.
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

// Also when a stored map has a keyframe with the same id as its predecessor.
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

// Where few landmarks are shared by successive keyframes, the odometry adds information from the images in between.
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
