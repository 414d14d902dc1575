// SPDX-License-Identifier: BSD-3-Clause
// Moving objects are not mistaken for camera motion: pairs of points, regions of an image, and a screen that is carried
// past the camera and fills its view.
#include <algorithm>

#include <gtest/gtest.h>

#include "corner_world.h"
#include "vip_slam_frontend/front_end.h"
#include "vip_slam_frontend/tracking/moving_regions.h"
#include "vip_slam_frontend/tracking/predicted_motion.h"

namespace vip_slam {
namespace {

constexpr double kThreshold = 2.0 / 480;

/// A point cloud in front of the camera, seen again after a motion of `T_current_previous`.
std::vector<PointPair> points(int n, const SE3& T_current_previous, int age, unsigned seed) {
  cv::RNG random(seed);
  std::vector<PointPair> pairs;
  for (int i = 0; i < n; ++i) {
    const double z = random.uniform(1.0, 3.0);
    const Eigen::Vector3d p(z * random.uniform(-0.6, 0.6), z * random.uniform(-0.4, 0.4), z);
    const Eigen::Vector3d q = T_current_previous * p;
    pairs.push_back({p.head<2>() / p.z(), q.head<2>() / q.z(), p.z(), age});
  }
  return pairs;
}

std::vector<PointPair> operator+(std::vector<PointPair> a, const std::vector<PointPair>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

const SE3 kCamera(Eigen::Matrix3d(expSO3(Eigen::Vector3d(0.01, -0.02, 0.005))), Eigen::Vector3d(0.02, 0.0, -0.01));
/// Apparent motion of the camera relative to a body that moves sideways by 5 cm.
const SE3 kBody(kCamera.rotation(), kCamera.t() + Eigen::Vector3d(0.05, 0, 0));

PredictedMotion prediction() { return {kCamera, 0.0005, 0.05, true}; }

RansacResult reject(const std::vector<PointPair>& pairs, const PredictedMotion& motion, bool* moves) {
  RansacOptions options;
  options.threshold = kThreshold;
  return rejectOutliers(pairs, motion, options, moves);
}

TEST(MovingBodies, NewPointsThatContradictTheImuMoveByThemselves) {
  const std::vector<PointPair> pairs = points(60, kBody, 1, 1) + points(15, kCamera, 30, 2);
  ASSERT_GE(rejectOutliers(pairs, kCamera, RansacOptions()).inliers, 55);  // most agree on the body's motion
  bool moves = false;
  const RansacResult kept = reject(pairs, prediction(), &moves);
  EXPECT_TRUE(moves);
  EXPECT_TRUE(kept.ok);
  EXPECT_GE(kept.inliers, 15);
  EXPECT_LE(kept.inliers, 17);
  EXPECT_LT((kept.T_current_previous.t() - kCamera.t()).norm(), 1e-3);
}

TEST(MovingBodies, AnImuThatIsOffTakesThePointsNearWhatItForetells) {
  const std::vector<PointPair> pairs = points(60, kBody, 1, 1) + points(15, kCamera, 30, 2);
  PredictedMotion off = prediction();
  off.T_current_previous.t() += Eigen::Vector3d(-0.01, 0.005, 0.005);  // 5 px at the nearest
  off.sigma = 0.005;
  bool moves = false;
  const RansacResult kept = reject(pairs, off, &moves);
  EXPECT_TRUE(moves);
  EXPECT_GE(kept.inliers, 15);
  EXPECT_LE(kept.inliers, 17);
  EXPECT_LT((kept.T_current_previous.t() - kCamera.t()).norm(), 1e-3);
}

TEST(MovingBodies, AnOldBodyThatSetsOffIsToldByWhatElseIsOld) {
  bool moves = false;
  reject(points(60, kBody, 30, 1) + points(25, kCamera, 30, 2), prediction(), &moves);
  EXPECT_TRUE(moves);
}

TEST(MovingBodies, OldPointsThatAllContradictTheImuAreBelieved) {
  bool moves = true;
  const RansacResult kept = reject(points(60, kBody, 30, 1) + points(3, kCamera, 30, 2), prediction(), &moves);
  EXPECT_FALSE(moves);
  EXPECT_GE(kept.inliers, 60);
}

TEST(MovingBodies, WithinWhatTheImuLeavesOpenThePointsDecide) {
  const std::vector<PointPair> pairs = points(60, kBody, 1, 1);
  PredictedMotion unsure = prediction();
  unsure.sigma = 0.02;
  bool moves = true;
  reject(pairs, unsure, &moves);
  EXPECT_FALSE(moves);
  reject(pairs, prediction(), &moves);
  EXPECT_TRUE(moves);
  reject(points(60, kCamera, 1, 1), prediction(), &moves);
  EXPECT_FALSE(moves);
  PredictedMotion nothing = prediction();
  nothing.judges = false;
  reject(pairs, nothing, &moves);
  EXPECT_FALSE(moves);
}

TEST(MovingBodies, AfterALongTimeWithoutImagesOnlyAMajorityIsBelieved) {
  const auto random_matches = [](int n) {
    std::vector<PointPair> pairs = points(n, kCamera, 30, 1);
    const std::vector<PointPair> others = points(n, kCamera, 30, 2);
    for (int i = 0; i < n; ++i) pairs[i].xy_current = others[i].xy_current;
    return pairs;
  };
  PredictedMotion after_darkness = prediction();
  after_darkness.sigma = 0.2;
  after_darkness.interval = 4.5;
  bool moves = true;
  const RansacResult few = reject(random_matches(30) + points(12, kCamera, 30, 3), after_darkness, &moves);
  EXPECT_FALSE(few.ok);
  EXPECT_EQ(few.inliers, 0);
  EXPECT_EQ(std::count(few.inlier.begin(), few.inlier.end(), 0), 42);
  EXPECT_FALSE(moves);
  EXPECT_EQ(reject(points(4, kCamera, 30, 3), after_darkness, &moves).inliers, 0);  // four agree on anything
  const RansacResult most = reject(random_matches(30) + points(50, kCamera, 30, 3), after_darkness, &moves);
  EXPECT_TRUE(most.ok);
  EXPECT_GE(most.inliers, 50);
  EXPECT_LT((most.T_current_previous.t() - kCamera.t()).norm(), 1e-3);
  // From one image to the next a minority may be all that stands still.
  EXPECT_GE(reject(random_matches(30) + points(12, kCamera, 30, 3), prediction(), &moves).inliers, 12);
}

TEST(MovingBodies, RegionsGoByTheNearestPointAndItsDepth) {
  MovingRegions regions;
  for (int i = 0; i < 40; ++i) regions.add(Eigen::Vector2f(10 * i, 100), 4.0, true);
  for (int i = 0; i < 4; ++i) regions.add(Eigen::Vector2f(300, 200 + 10 * i), 2.0, false);
  EXPECT_FALSE(regions.any());  // stray mismatches
  EXPECT_FALSE(regions.moves({300, 215}, 2.0));
  for (int i = 0; i < 4; ++i) regions.add(Eigen::Vector2f(310, 200 + 10 * i), 2.0, false);
  EXPECT_TRUE(regions.any());
  EXPECT_TRUE(regions.moves({300, 215}, 2.1));
  EXPECT_TRUE(regions.moves({300, 215}, 0));
  EXPECT_FALSE(regions.moves({280, 215}, 4.0));  // the wall behind
  EXPECT_FALSE(regions.moves({300, 120}, 2.0));
  EXPECT_FALSE(MovingRegions().moves({10, 10}, 1.0));
}

TEST(MovingBodies, AScreenCarriedPastTheCameraMovesNothing) {
  const CornerWorld world;
  FrontEnd front_end(cornerOptions(), cornerSensor(0, 0));
  double imu_t = 0, square = 0;
  double recognised = 1e9;
  int n = 0, blocked = 0, on_screen = 0, handed_on = 0;
  TrackingStatus status;
  for (int k = 0; k < 140; ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.03; imu_t += 0.005) front_end.addImu(CornerWorld::imu(imu_t));
    FrameInput input;
    input.t = t;
    const Screen screen{0.9, -3.0 + 1.2 * (t - 1.5), 2.4};
    world.look(t, 0, &input.gray, &input.depth, screen);
    const FrameOutput output = front_end.process(input);
    const TrackedFramePtr frame = output.frame;
    status = frame->status;
    if (front_end.counters().moving > 0) recognised = std::min(recognised, t);
    // Keyframes that show the screen's edge before it is recognised cannot leave it out.
    if (output.keyframe && t > std::min(recognised, 3.5)) {
      const SE3 T_W_C = CornerWorld::pose(t) * cornerSensor(0, 0).T_imu_cam;
      for (const Feature& f : output.keyframe->frame.features) {
        const Eigen::Vector3d p_W = T_W_C * Eigen::Vector3d(f.xy.homogeneous().cast<double>() * f.depth);
        on_screen += f.depth > 0 && std::abs(p_W.x() - screen.x) < 0.05 && p_W.z() > -0.9;
        ++handed_on;
      }
    }
    blocked += status.state == TrackingState::kDegraded && status.reason.find("moves") != std::string::npos;
    if (t < kStill + 0.05) continue;
    square += (frame->state.T_W_I.t() - CornerWorld::pose(t).t()).squaredNorm();
    ++n;
  }
  EXPECT_GT(blocked, 5);
  EXPECT_LT(recognised, 3.5);  // it comes into view at three seconds
  EXPECT_GT(handed_on, 500);
  EXPECT_LT(on_screen, handed_on / 50);
  EXPECT_EQ(status.state, TrackingState::kTracking) << status.reason;
  EXPECT_EQ(front_end.counters().restarts, 0u);
  EXPECT_LT(std::sqrt(square / n), 0.02);
}

TEST(MovingBodies, StandsStillWhileAScreenThatHidesAllSwaysToAndFro) {
  const CornerWorld world;
  FrontEnd front_end(cornerOptions(), cornerSensor(0, 0));
  double imu_t = 0, most = 0;
  int standing = 0, images = 0;
  for (int k = 0; k < 300; ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.03; imu_t += 0.005) {
      ImuSample sample = CornerWorld::imu(0);
      sample.t = imu_t;
      front_end.addImu(sample);
    }
    FrameInput input;
    input.t = t;
    const Screen screen{0.9, 0.9 * std::sin(0.7 * (t - 3.0)), t < 3.0 ? 0.0 : 3.2};
    world.look(0, 0, &input.gray, &input.depth, screen);
    const TrackedFramePtr frame = front_end.process(input).frame;
    if (t < 3.0) continue;
    most = std::max(most, (frame->state.T_W_I.t() - CornerWorld::pose(0).t()).norm());
    standing += frame->zero_velocity;
    ++images;
  }
  EXPECT_LT(most, 0.005);
  EXPECT_GT(standing, 0.9 * images);
}

}  // namespace
}  // namespace vip_slam
