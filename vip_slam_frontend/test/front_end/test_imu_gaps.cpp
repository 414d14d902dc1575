// SPDX-License-Identifier: BSD-3-Clause
// IMU gaps during rotation, with images and without.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "corner_world.h"
#include "vip_slam_frontend/front_end.h"

namespace vip_slam {
namespace {

/// Results of a flight with gaps.
struct Flight {
  double most_nees = 0, most_motion_nees = 0;  ///< largest after the first gap: of a pose, of a keyframe's motion
  double most_turn = 0, most_off = 0;          ///< rad, m
  std::uint64_t restarts = 0;
  std::string reason;  ///< of the first image after the first gap
};

/// Eight seconds in front of the corner at `speed` times its motion; the IMU is missing for `gap` seconds at 4, 6 and 8
/// s, and with `images_too` the images as well.
Flight fly(double gap, bool images_too, double speed = 1.0) {
  const CornerWorld world;
  FrontEnd front_end(cornerOptions(), cornerSensor(0, 0));
  const auto missing = [gap](double t) { return t > 3.9 && std::fmod(t, 2.0) > 1e-6 && std::fmod(t, 2.0) < gap; };
  Flight flight;
  double imu_t = 0;
  SE3 last_keyframe;
  for (int k = 0; k < 255; ++k) {
    const double t = k / 30.0;
    for (; !front_end.ready(t); imu_t += 0.005) {
      if (!missing(imu_t)) front_end.addImu(CornerWorld::imu(imu_t, speed));
    }
    if (images_too && missing(t)) continue;
    FrameInput input;
    input.t = t;
    world.look(CornerWorld::atSpeed(speed, t), 0, &input.gray, &input.depth);
    const FrameOutput output = front_end.process(input);
    if (t > 4.0 && flight.reason.empty() && !missing(t)) flight.reason = output.frame->status.reason;
    flight.restarts = front_end.counters().restarts;
    if (flight.restarts > 0) break;
    const SE3 truth = CornerWorld::pose(CornerWorld::atSpeed(speed, output.frame->state.t));
    const Vector6d e = truth.boxminus(output.frame->state.T_W_I);
    if (t > 4.0) {
      const Matrix6d C = output.frame->covariance.topLeftCorner<6, 6>();
      flight.most_nees = std::max(flight.most_nees, e.dot(C.ldlt().solve(e)));
      flight.most_turn = std::max(flight.most_turn, e.head<3>().norm());
      flight.most_off = std::max(flight.most_off, e.tail<3>().norm());
    }
    if (!output.keyframe) continue;
    if (t > 4.0 && output.keyframe->motion.isUsable()) {
      const RelativeMotion& motion = output.keyframe->motion;
      const Vector6d d = (last_keyframe.inverse() * truth).boxminus(motion.T_a_b);
      flight.most_motion_nees = std::max(flight.most_motion_nees, d.dot(motion.covariance.ldlt().solve(d)));
    }
    last_keyframe = truth;
  }
  return flight;
}

TEST(ImuGaps, InATurnTheyAreBridgedByImagesAndDoubted) {
  for (const double gap : {0.12, 0.2, 0.3, 0.45}) {
    const Flight flight = fly(gap, false);
    EXPECT_EQ(flight.restarts, 0u) << gap << ' ' << flight.reason;
    EXPECT_LT(flight.most_nees, 25.0) << gap;
    EXPECT_LT(flight.most_motion_nees, 25.0) << gap;
    EXPECT_LT(flight.most_off, 0.02) << gap;
    EXPECT_LT(flight.most_turn, 0.01) << gap;
  }
}

TEST(ImuGaps, WhereImagesAreMissingAsWellTheNextOneTellsOrItStartsAnew) {
  for (const double gap : {0.12, 0.2, 0.3}) {
    const Flight flight = fly(gap, true);
    EXPECT_EQ(flight.restarts, 0u) << gap << ' ' << flight.reason;
    EXPECT_LT(flight.most_nees, 25.0) << gap;
    EXPECT_LT(flight.most_motion_nees, 25.0) << gap;
  }
  const Flight turning = fly(0.48, true), slow = fly(0.48, true, 0.2);
  EXPECT_EQ(turning.restarts, 1u);
  EXPECT_NE(turning.reason.find("IMU and images are missing for 0."), std::string::npos) << turning.reason;
  EXPECT_EQ(slow.restarts, 0u) << slow.reason;
  EXPECT_LT(slow.most_nees, 25.0);
  EXPECT_LT(slow.most_off, 0.02);
}

}  // namespace
}  // namespace vip_slam
