// SPDX-License-Identifier: BSD-3-Clause
// What the back end does with bad input: refused by name or bridged, and the map stays valid.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "back_end/back_end_runs.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map/map_limits.h"

using namespace vip_slam;

TEST(BackEnd, BadInputIsRefusedByName) {
  SimulatedKeyframes world(5);
  BackEnd back_end(options("vip"), world.sensor());
  feed(&world, &back_end, 4);
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
  bad.frame.camera_correction.curve.added = {0.f, std::nanf("")};
  EXPECT_NE(refusalOf(bad).find("depth curve"), std::string::npos);
  bad = *good;
  bad.frame.T_chain_C.t().x() = std::nan("");
  EXPECT_NE(refusalOf(bad).find("chained pose"), std::string::npos);
  bad = *good;
  bad.frame.t = 0.1;
  EXPECT_NE(refusalOf(bad).find("not after"), std::string::npos);
  EXPECT_EQ(back_end.addKeyframe(nullptr).keyframes.size(), 0u);
  EXPECT_NE(back_end.lastRefusal().find("no keyframe"), std::string::npos);
  // A good one still enters afterwards.
  back_end.addKeyframe(good);
  EXPECT_EQ(back_end.lastRefusal(), "");
}

// One after the other: the rest of the update is applied.
TEST(BackEnd, PartsOfAPlaneUpdateAreRefusedByName) {
  SimulatedKeyframes world(5);
  BackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 3; ++k) back_end.addKeyframe(world.next());
  EXPECT_TRUE(back_end.takeRefusals().empty());
  const PlaneUpdate good = world.planes();
  const auto refusalsOf = [&](const std::function<void(PlaneUpdate*)>& spoil) {
    PlaneUpdate bad = good;
    spoil(&bad);
    back_end.applyPlaneUpdate(bad);
    EXPECT_EQ(checkMap(back_end.map()), "");
    const std::vector<std::string> reasons = back_end.takeRefusals();
    EXPECT_TRUE(back_end.takeRefusals().empty());
    return reasons.size() == 1 ? reasons[0] : std::to_string(reasons.size()) + " reasons";
  };
  const double nan = std::nan("");
  EXPECT_NE(refusalsOf([=](PlaneUpdate* u) { u->planes[0].plane.d = nan; }).find("plane 1: parameters"),
            std::string::npos);
  EXPECT_EQ(back_end.map().planes().count(good.planes[0].id), 0u);
  EXPECT_EQ(back_end.map().planes().size() + 1, good.planes.size());
  EXPECT_NE(refusalsOf([=](PlaneUpdate* u) { u->observations[0].G(0, 1) = nan; }).find("moments"), std::string::npos);
  const PlaneObservation& first = good.observations[0];
  EXPECT_EQ(back_end.map().keyframe(first.keyframe).planes.count(first.plane), 0u);
  EXPECT_NE(refusalsOf([=](PlaneUpdate* u) { u->observations[0].points[2].p_C.y() = float(nan); }).find("a point"),
            std::string::npos);
  for (const double weight : {nan, 0.0, std::numeric_limits<double>::infinity()}) {
    EXPECT_NE(refusalsOf([=](PlaneUpdate* u) { u->observations[0].weight_scale = weight; }).find("weight"),
              std::string::npos);
  }
  EXPECT_NE(refusalsOf([=](PlaneUpdate* u) { u->observations[0].camera_correction.offset = nan; }).find("camera's"),
            std::string::npos);
  EXPECT_EQ(back_end.map().keyframe(first.keyframe).planes.count(first.plane), 0u);
  back_end.applyPlaneUpdate(good);
  EXPECT_TRUE(back_end.takeRefusals().empty());
  EXPECT_EQ(back_end.map().keyframe(first.keyframe).planes.count(first.plane), 1u);
}

TEST(BackEnd, PlanesAndMergesThatAreNoneAreRefusedByName) {
  SimulatedKeyframes world(5);
  BackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 3; ++k) back_end.addKeyframe(world.next());
  const PlaneUpdate good = world.planes();
  back_end.applyPlaneUpdate(good);
  const auto refusalOf = [&](const std::function<void(PlaneUpdate*)>& spoil) {
    PlaneUpdate bad = good;
    spoil(&bad);
    back_end.takeRefusals();
    back_end.applyPlaneUpdate(bad);
    EXPECT_EQ(checkMap(back_end.map()), "");
    EXPECT_FALSE(back_end.map().hasPlane(0));
    const std::vector<std::string> reasons = back_end.takeRefusals();
    return reasons.empty() ? "" : reasons.front();
  };
  EXPECT_NE(refusalOf([](PlaneUpdate* u) { u->planes[0].plane.n *= 1.1; }).find("normal of length 1.1"),
            std::string::npos);
  EXPECT_NE(refusalOf([](PlaneUpdate* u) { u->planes[0].kind = PlaneKind(7); }).find("kind 7"), std::string::npos);
  EXPECT_TRUE(back_end.map().hasPlane(good.planes[0].id)) << "a plane that is named stays as it is";
  EXPECT_NE(refusalOf([&](PlaneUpdate* u) {
              u->merges.push_back({good.planes[1].id, 0});
            }).find("into plane 0"),
            std::string::npos);
  EXPECT_TRUE(back_end.map().hasPlane(good.planes[1].id));
  EXPECT_NE(refusalOf([](PlaneUpdate* u) { u->planes[1].id = 0; }).find("needs an id"), std::string::npos);
}

// The motion over a hole in the samples is unknown: the keyframe enters without an IMU factor.
TEST(BackEnd, ImuWithAHoleMakesNoFactor) {
  const auto hole = [](Keyframe* kf) { kf->imu.erase(kf->imu.begin() + 2, kf->imu.end() - 2); };
  const auto late = [](Keyframe* kf) { kf->imu.erase(kf->imu.begin(), kf->imu.begin() + 3); };
  for (const bool inside : {true, false}) {
    SimulatedKeyframes world(5);
    BackEnd back_end(options("vip"), world.sensor());
    for (int k = 0; k < 4; ++k) back_end.addKeyframe(world.next());
    Keyframe kf = *world.next();
    const double span = kf.imu.back().t - kf.imu.front().t;
    ASSERT_GT(span, map_limits::kLongestImuStep + 0.05) << "the test needs longer intervals";
    inside ? hole(&kf) : late(&kf);
    back_end.addKeyframe(std::make_shared<Keyframe>(kf));
    EXPECT_EQ(back_end.lastRefusal(), "");
    EXPECT_EQ(back_end.map().keyframe(kf.id).preintegration, nullptr) << inside;
    EXPECT_EQ(back_end.snapshot().statistics.without_imu, 1u);
    EXPECT_EQ(checkMap(back_end.map()), "");
    const KeyframePtr next = world.next();
    back_end.addKeyframe(next);
    EXPECT_NE(back_end.map().keyframe(next->id).preintegration, nullptr);
  }
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
    EXPECT_EQ(back_end.takeNotices().size(), k == 4 || k == 5 || k == 9 ? 1u : 0u) << k;
    EXPECT_EQ(back_end.snapshot().statistics.without_imu, k < 7 ? 0u : k < 9 ? 1u : 2u) << k;
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
