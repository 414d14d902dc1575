// SPDX-License-Identifier: BSD-3-Clause
// Core types are unchanged after conversion to messages, serialisation and back.
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>
#include <ros/serialization.h>

#include "vip_slam_ros/frame_conversions.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/map_conversions.h"
#include "vip_slam_ros/plane_conversions.h"

namespace vip_slam {
namespace {

/// Serialises and deserialises, as for a message to another process.
template <class Message>
Message throughBytes(const Message& message) {
  const ros::SerializedMessage bytes = ros::serialization::serializeMessage(message);
  ros::serialization::IStream stream(bytes.message_start, std::uint32_t(bytes.num_bytes - 4));
  Message result;
  ros::serialization::deserialize(stream, result);
  return result;
}

class Conversions : public ::testing::Test {
 protected:
  double number() { return std::uniform_real_distribution<double>(-5, 5)(random_); }
  Eigen::Vector3d vector() { return {number(), number(), number()}; }
  SE3 pose() { return SE3(expQuaternion(vector()), vector()); }

  NavState state() {
    NavState s;
    s.t = 1e9 + 0.123456789123;
    s.T_W_I = pose();
    s.v_W = vector();
    s.bias_gyro = vector();
    s.bias_accel = vector();
    return s;
  }
  Feature feature() {
    Feature f;
    f.id = LandmarkId(random_()) - (LandmarkId(1) << 31);
    f.pixel = vector().head<2>().cast<float>();
    f.xy = vector().head<2>().cast<float>();
    f.pixel_sigma = float(number());
    f.depth = float(number());
    f.depth_sigma = float(number());
    f.angle = float(number());
    f.octave = std::uint8_t(random_() % 8);
    f.age = random_();
    for (auto& byte : f.descriptor) byte = std::uint8_t(random_());
    return f;
  }
  TrackedFrame frame() {
    TrackedFrame f;
    f.t = ros::Time(1600000000, 123456789).toSec();
    f.epoch = 3;
    f.status = {TrackingState::kDegraded, "no depth"};
    f.state = state();
    f.covariance.setRandom();
    f.T_I_C = pose();
    f.T_chain_C = pose();
    f.camera_correction = {number(),
                           {{0.001f, -0.002f}},
                           {{number(), number(), number(), number()}},
                           {{number(), number()}, {number(), number()}},
                           1.0 + 0.1 * number()};
    f.time_offset = number();
    for (int i = 0; i < 5; ++i) f.features.push_back(feature());
    f.depth_grid.stride = 16;
    f.depth_grid.offset = 8;
    f.depth_grid.cols = 3;
    f.depth_grid.rows = 2;
    f.depth_grid.z = {1, 2, 0, 4, 5.5f, 6};
    f.zero_velocity = true;
    f.keyframe = 17;
    return f;
  }
  PlaneEstimate plane(PlaneId id) {
    PlaneEstimate p;
    p.id = id;
    p.kind = PlaneKind::kVertical;
    p.plane = Plane(vector(), number());
    p.polygons.resize(2);
    p.polygons[0].outer = {vector(), vector(), vector()};
    p.polygons[0].holes = {{vector(), vector(), vector()}};
    p.polygons[1].outer = {vector(), vector(), vector(), vector()};
    p.area = 2.5;
    p.keyframes = 9;
    return p;
  }

  std::mt19937 random_{7};
};

void expectSame(const SE3& a, const SE3& b) {
  EXPECT_EQ(a.t(), b.t());
  EXPECT_LT((a.rotation().coeffs() - b.rotation().coeffs()).norm(), 1e-15);
}

void expectSame(const NavState& a, const NavState& b) {
  EXPECT_EQ(a.t, b.t);
  expectSame(a.T_W_I, b.T_W_I);
  EXPECT_EQ(a.v_W, b.v_W);
  EXPECT_EQ(a.bias_gyro, b.bias_gyro);
  EXPECT_EQ(a.bias_accel, b.bias_accel);
}

void expectSame(const TrackedFrame& a, const TrackedFrame& b) {
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.epoch, b.epoch);
  EXPECT_EQ(a.status.state, b.status.state);
  EXPECT_EQ(a.status.reason, b.status.reason);
  expectSame(a.state, b.state);
  EXPECT_EQ(a.covariance, b.covariance);
  expectSame(a.T_I_C, b.T_I_C);
  expectSame(a.T_chain_C, b.T_chain_C);
  EXPECT_EQ(a.camera_correction, b.camera_correction);
  EXPECT_EQ(a.time_offset, b.time_offset);
  ASSERT_EQ(a.features.size(), b.features.size());
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    const Feature &f = a.features[i], &g = b.features[i];
    EXPECT_EQ(f.id, g.id);
    EXPECT_EQ(f.pixel, g.pixel);
    EXPECT_EQ(f.xy, g.xy);
    EXPECT_EQ(f.pixel_sigma, g.pixel_sigma);
    EXPECT_EQ(f.depth, g.depth);
    EXPECT_EQ(f.depth_sigma, g.depth_sigma);
    EXPECT_EQ(f.angle, g.angle);
    EXPECT_EQ(f.octave, g.octave);
    EXPECT_EQ(f.age, g.age);
    EXPECT_EQ(f.descriptor, g.descriptor);
  }
  EXPECT_EQ(a.depth_grid.stride, b.depth_grid.stride);
  EXPECT_EQ(a.depth_grid.offset, b.depth_grid.offset);
  EXPECT_EQ(a.depth_grid.cols, b.depth_grid.cols);
  EXPECT_EQ(a.depth_grid.rows, b.depth_grid.rows);
  EXPECT_EQ(a.depth_grid.z, b.depth_grid.z);
  EXPECT_EQ(a.zero_velocity, b.zero_velocity);
  EXPECT_EQ(a.keyframe, b.keyframe);
}

void expectSame(const PlaneEstimate& a, const PlaneEstimate& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.plane.coefficients(), b.plane.coefficients());
  ASSERT_EQ(a.polygons.size(), b.polygons.size());
  for (std::size_t i = 0; i < a.polygons.size(); ++i) {
    EXPECT_EQ(a.polygons[i].outer, b.polygons[i].outer);
    EXPECT_EQ(a.polygons[i].holes, b.polygons[i].holes);
  }
  EXPECT_EQ(a.area, b.area);
  EXPECT_EQ(a.keyframes, b.keyframes);
}

TEST_F(Conversions, KeyframeIsUnchanged) {
  Keyframe keyframe;
  keyframe.id = 18;
  keyframe.frame = frame();
  keyframe.previous = 17;
  for (int i = 0; i < 4; ++i) keyframe.imu.push_back({1e9 + 0.1 * i, vector(), vector()});
  keyframe.gyro_correction << 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09;
  keyframe.imu_noise_scale = {2.5, 30, 4};
  keyframe.depth_noise = {0.1, 0.3};
  keyframe.motion.T_a_b = keyframe.frame.T_I_C;
  for (int i = 0; i < 36; ++i) keyframe.motion.covariance(i / 6, i % 6) = vector().x();
  const Keyframe back = fromMsg(throughBytes(toMsg(keyframe, "odom")));
  EXPECT_LT(back.motion.T_a_b.boxminus(keyframe.motion.T_a_b).norm(), 1e-14);
  EXPECT_EQ(back.motion.covariance, keyframe.motion.covariance);
  EXPECT_EQ(back.imu_noise_scale.density, 2.5);
  EXPECT_EQ(back.imu_noise_scale.gyro_walk, 30);
  EXPECT_EQ(back.imu_noise_scale.accel_walk, 4);
  EXPECT_EQ(back.depth_noise.white, 0.1);
  EXPECT_EQ(back.depth_noise.shared, 0.3);
  EXPECT_EQ(back.id, keyframe.id);
  EXPECT_EQ(back.previous, keyframe.previous);
  expectSame(back.frame, keyframe.frame);
  EXPECT_EQ(back.gyro_correction, keyframe.gyro_correction);
  ASSERT_EQ(back.imu.size(), keyframe.imu.size());
  for (std::size_t i = 0; i < back.imu.size(); ++i) {
    EXPECT_EQ(back.imu[i].t, keyframe.imu[i].t);
    EXPECT_EQ(back.imu[i].gyro, keyframe.imu[i].gyro);
    EXPECT_EQ(back.imu[i].accel, keyframe.imu[i].accel);
  }
}

TEST_F(Conversions, PlaneUpdateIsUnchanged) {
  PlaneUpdate update;
  update.revision = 5;
  update.t = ros::Time(1600000000, 987654321).toSec();
  update.merges = {{4, 2}};
  update.removed = {7};
  update.planes = {plane(1), plane(2)};
  PlaneObservation observation;
  observation.keyframe = 3;
  observation.plane = 2;
  observation.G.setRandom();
  observation.weight_scale = 0.25;
  observation.camera_correction = {
      -0.01, {{0.003f}}, {{0.001, -0.002, 0.003, 0.004}}, {{1.5, -0.5}, {0.003, -0.001}}, 0.97};
  observation.points = {{{1, 2, 3}, 0.01f}, {{4, 5, 6}, 0.02f}};
  update.observations = {observation};
  update.associated = {{11, 2}, {12, 1}};
  update.dissociated = {13};
  std::vector<std::string> refused;
  const PlaneUpdate back = fromMsg(throughBytes(toMsg(update, "map")), &refused);
  EXPECT_TRUE(refused.empty());
  EXPECT_EQ(back.revision, update.revision);
  EXPECT_EQ(back.t, update.t);
  ASSERT_EQ(back.merges.size(), 1u);
  EXPECT_EQ(back.merges[0].from, 4u);
  EXPECT_EQ(back.merges[0].into, 2u);
  EXPECT_EQ(back.removed, update.removed);
  ASSERT_EQ(back.planes.size(), 2u);
  for (int i = 0; i < 2; ++i) expectSame(back.planes[i], update.planes[i]);
  ASSERT_EQ(back.observations.size(), 1u);
  EXPECT_EQ(back.observations[0].keyframe, 3u);
  EXPECT_EQ(back.observations[0].plane, 2u);
  EXPECT_EQ(back.observations[0].G, observation.G);
  EXPECT_EQ(back.observations[0].weight_scale, 0.25);
  EXPECT_EQ(back.observations[0].camera_correction, observation.camera_correction);
  ASSERT_EQ(back.observations[0].points.size(), 2u);
  EXPECT_EQ(back.observations[0].points[1].p_C, observation.points[1].p_C);
  EXPECT_EQ(back.observations[0].points[1].sigma, observation.points[1].sigma);
  EXPECT_EQ(back.associated, update.associated);
  EXPECT_EQ(back.dissociated, update.dissociated);
}

TEST_F(Conversions, AnUnreadableObservationLeavesTheRestOfItsUpdate) {
  PlaneUpdate update;
  update.planes = {plane(1), plane(2)};
  update.associated = {{11, 2}};
  update.observations.resize(2);
  for (int k = 0; k < 2; ++k) {
    update.observations[k].keyframe = 3 + k;
    update.observations[k].plane = 2;
    update.observations[k].points = {{{1, 2, 3}, 0.01f}};
  }
  vip_slam_msgs::PlaneUpdate msg = toMsg(update, "map");
  msg.observations[0].points.push_back(1);
  msg.planes[0].kind = 9;  // the map refuses it, and must know that the plane is named
  std::vector<std::string> refused;
  const PlaneUpdate back = fromMsg(msg, &refused);
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_NE(refused[0].find("plane 2, seen by keyframe 3: 5 values"), std::string::npos) << refused[0];
  EXPECT_EQ(back.planes.size(), 2u);
  EXPECT_EQ(back.associated, update.associated);
  ASSERT_EQ(back.observations.size(), 1u);
  EXPECT_EQ(back.observations[0].keyframe, 4u);
}

// It must not pass for "no rotation".
TEST_F(Conversions, AnOrientationThatIsNoneIsRefused) {
  const double nan = std::nan("");
  for (const std::array<double, 4>& q : {std::array<double, 4>{0, 0, 0, 0}, {nan, 0, 0, 1}, {0, 0, 0, 2}}) {
    const auto spoil = [&q](auto& orientation) {
      orientation.x = q[0], orientation.y = q[1], orientation.z = q[2], orientation.w = q[3];
    };
    Keyframe keyframe;
    keyframe.frame = frame();
    const vip_slam_msgs::Keyframe good = toMsg(keyframe, "odom");
    EXPECT_NO_THROW(fromMsg(good));
    vip_slam_msgs::Keyframe bad = good;
    spoil(bad.frame.state.pose.orientation);
    EXPECT_THROW(fromMsg(bad), std::invalid_argument);
    bad = good;
    spoil(bad.frame.imu_camera.orientation);
    EXPECT_THROW(fromMsg(bad), std::invalid_argument);
    bad = good;
    spoil(bad.frame.chain_camera.orientation);
    EXPECT_THROW(fromMsg(bad), std::invalid_argument);
    vip_slam_msgs::MapUpdate update = toMsg(MapUpdate(), "map");
    EXPECT_NO_THROW(fromMsg(update));
    spoil(update.map_odom.orientation);
    EXPECT_THROW(fromMsg(update), std::invalid_argument);
  }
}

TEST_F(Conversions, PlanesOfALoadedMapComeWithTheirHosts) {
  PlaneEstimate plane;
  plane.id = 4;
  plane.plane = Plane(vector(), 1.5);
  const std::vector<vip_slam_msgs::Plane> planes = {toMsg(plane)};
  const PlaneHost host{17, 0x80000001u, pose()};
  const std::vector<StoredPlane> back = fromMsg(planes, {throughBytes(toMsg(host))});
  ASSERT_EQ(back.size(), 1u);
  EXPECT_EQ(back[0].estimate.id, 4u);
  EXPECT_EQ(back[0].host.keyframe, 17u);
  EXPECT_EQ(back[0].host.epoch, 0x80000001u);
  expectSame(back[0].host.T_map_C, host.T_map_C);
  EXPECT_THROW(fromMsg(planes, {}), std::invalid_argument);
}

TEST_F(Conversions, MapUpdateIsUnchanged) {
  MapUpdate update;
  update.revision = 6;
  update.t = ros::Time(1600000001, 1).toSec();
  update.epoch = 2;
  update.T_map_odom = pose();
  update.parts = {{0, 0}, {2, 0}, {3, 3}};
  update.newest_keyframe = 30;
  update.depth_curve.added = {0.f, -0.001f, 0.004f};
  update.disparity_error = -0.0021;
  update.odometry_variance = 2.25;
  update.global = true;
  update.keyframes = {{29, state(), pose(), {}}, {30, state(), pose(), {-0.004, {{0.f, 0.002f}}, {}, {}}}};
  LandmarkEstimate landmark;
  landmark.id = 77;
  landmark.p_W = vector();
  landmark.observations = 6;
  landmark.plane = 2;
  landmark.descriptor[5] = 200;
  update.landmarks = {landmark};
  update.planes = {{2, Plane(vector(), 1.5)}};
  update.removed_keyframes = {3};
  update.removed_landmarks = {4, 5};
  update.merged_landmarks = {{8, 9}};
  LoopEvent loop;
  loop.query = 30;
  loop.match = 2;
  loop.accepted = true;
  loop.reason = "41 inliers";
  loop.inliers = 41;
  loop.T_match_query = pose();
  loop.t = 12.5;
  update.loops = {loop};
  const MapUpdate back = fromMsg(throughBytes(toMsg(update, "map")));
  EXPECT_EQ(back.revision, update.revision);
  EXPECT_EQ(back.t, update.t);
  EXPECT_EQ(back.epoch, update.epoch);
  expectSame(back.T_map_odom, update.T_map_odom);
  EXPECT_EQ(back.newest_keyframe, update.newest_keyframe);
  ASSERT_EQ(back.parts.size(), 3u);
  EXPECT_EQ(back.parts[1].epoch, 2u);
  EXPECT_EQ(back.parts[1].part, 0u);
  EXPECT_TRUE(back.global);
  ASSERT_EQ(back.keyframes.size(), 2u);
  EXPECT_EQ(back.keyframes[1].id, 30u);
  expectSame(back.keyframes[1].state, update.keyframes[1].state);
  expectSame(back.keyframes[1].T_I_C, update.keyframes[1].T_I_C);
  EXPECT_EQ(back.keyframes[1].camera_correction, update.keyframes[1].camera_correction);
  EXPECT_EQ(back.depth_curve, update.depth_curve);
  EXPECT_EQ(back.disparity_error, update.disparity_error);
  EXPECT_EQ(back.odometry_variance, update.odometry_variance);
  ASSERT_EQ(back.landmarks.size(), 1u);
  EXPECT_EQ(back.landmarks[0].id, 77);
  EXPECT_EQ(back.landmarks[0].p_W, landmark.p_W);
  EXPECT_EQ(back.landmarks[0].observations, 6u);
  EXPECT_EQ(back.landmarks[0].plane, 2u);
  EXPECT_EQ(back.landmarks[0].descriptor, landmark.descriptor);
  ASSERT_EQ(back.planes.size(), 1u);
  EXPECT_EQ(back.planes[0].second.coefficients(), update.planes[0].second.coefficients());
  EXPECT_EQ(back.removed_keyframes, update.removed_keyframes);
  EXPECT_EQ(back.removed_landmarks, update.removed_landmarks);
  EXPECT_EQ(back.merged_landmarks, update.merged_landmarks);
  ASSERT_EQ(back.loops.size(), 1u);
  EXPECT_EQ(back.loops[0].reason, loop.reason);
  EXPECT_TRUE(back.loops[0].accepted);
  EXPECT_EQ(back.loops[0].inliers, 41);
  EXPECT_EQ(back.loops[0].t, 12.5);
  expectSame(back.loops[0].T_match_query, loop.T_match_query);
}

TEST_F(Conversions, StampsSurvive) {
  std::uniform_int_distribution<std::uint32_t> seconds(0, 4000000000u), nanoseconds(0, 999999999u);
  for (int i = 0; i < 1000; ++i) {
    const double t = ros::Time(seconds(random_), nanoseconds(random_)).toSec();
    EXPECT_EQ(toStamp(t).toSec(), t);
  }
  // Drivers stamp with whole milliseconds or microseconds, which are recovered to the nanosecond.
  for (const std::uint32_t ns : {0u, 900000000u, 45000000u, 123456000u, 999999000u, 1000u}) {
    const ros::Time stamp(1600000005u, ns);
    EXPECT_EQ(toStamp(stamp.toSec()), stamp) << ns;
  }
  EXPECT_EQ(toStamp(-1), ros::Time());
  EXPECT_EQ(toStamp(std::nan("")), ros::Time());
}

TEST_F(Conversions, ContradictoryMessagesAreNamed) {
  vip_slam_msgs::TrackingStatus status;
  status.state = 9;
  EXPECT_THROW(fromMsg(status), std::invalid_argument);
  vip_slam_msgs::DepthGrid grid;
  grid.cols = 2;
  grid.rows = 2;
  grid.z = {1, 2, 3};
  EXPECT_THROW(fromMsg(grid), std::invalid_argument);
  vip_slam_msgs::PlaneObservation observation;
  observation.points = {1, 2, 3};
  EXPECT_THROW(fromMsg(observation), std::invalid_argument);
}

}  // namespace
}  // namespace vip_slam
