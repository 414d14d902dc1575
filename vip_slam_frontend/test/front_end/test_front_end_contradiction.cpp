// SPDX-License-Identifier: BSD-3-Clause
// The facade when images and IMU contradict each other: repeated images, shocks that the IMU measures wrongly.
#include <cmath>
#include <functional>

#include "wall_world.h"

namespace vip_slam {
namespace {

class ContradictionTest : public FrontEndTest {
 protected:
  FrameOutput show(double t, double t_shown) {
    feedImu(t);
    return front_end_.process({t, world_.image(t_shown), World::depth(t_shown)});
  }
};

TEST_F(ContradictionTest, ATopicThatIsFasterThanItsCameraCostsNothing) {
  run(0.0, 3.0);
  FrameOutput output;
  for (int k = 60; k < 200; ++k) {
    output = show(0.05 * k, 0.05 * (k - k % 2));  // every image twice
    EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << k << ' ' << output.frame->status.reason;
    EXPECT_LT(error(output), 0.03) << k;  // also for the IMU prediction in between
  }
  EXPECT_EQ(front_end_.counters().repeated_image, 70u);
  EXPECT_LT(front_end_.counters().imu_noise_scale, 2.0);
  EXPECT_EQ(output.frame->epoch, 0u);
}

TEST_F(ContradictionTest, ACameraThatFreezesIsNamedAndWaitedFor) {
  run(0.0, 3.0);
  FrameOutput output;
  for (int k = 60; k < 100; ++k) {
    const double t = 0.05 * k;
    output = show(t, 2.95);
    if (t < 3.5) continue;
    EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded) << t;
    EXPECT_NE(output.frame->status.reason.find("repeats the one before"), std::string::npos) << t;
    EXPECT_LT(error(output), 3.0 * std::sqrt(output.frame->covariance.block<3, 3>(3, 3).trace())) << t;
  }
  output = run(5.0, 6.5);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.03);
}

// Depth that has frozen while the image moves on must not be used.
TEST_F(ContradictionTest, DepthThatFreezesIsLeftOut) {
  run(0.0, 3.0);
  FrameOutput output;
  for (int k = 60; k < 100; ++k) {
    feedImu(0.05 * k);
    output = front_end_.process({0.05 * k, world_.image(0.05 * k), World::depth(2.95)});
    EXPECT_LT(error(output), 3.0 * std::sqrt(output.frame->covariance.block<3, 3>(3, 3).trace())) << k;
    EXPECT_LT(error(output), 0.15) << k;  // the drift without depth
  }
  const std::uint64_t repeated = front_end_.counters().repeated_depth;
  EXPECT_NEAR(repeated, 40, 1);
  EXPECT_EQ(output.frame->status.reason, "no depth: visual-inertial only");
  output = run(5.0, 6.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(front_end_.counters().repeated_depth, repeated);
}

TEST_F(ContradictionTest, WhatIsRenderedWithoutNoiseMayStand) {
  run(0.0, 3.0);
  // From 3 s on the motion slows down to rest within a second, and continues at 7 s.
  const auto warped = [](double t) {
    const double s = std::min(1.0, t - 3.0);
    if (t < 7.0) return 3.0 + s - s * s * s + 0.5 * s * s * s * s;
    const double u = std::min(1.0, t - 7.0);
    return 3.5 + u * u * u - 0.5 * u * u * u * u + std::max(0.0, t - 8.0);
  };
  FrameOutput output;
  for (int k = 60; k < 200; ++k) {
    const double t = 0.05 * k;
    for (; imu_t_ < t + 0.02; imu_t_ += 0.005) {
      const double h = 1e-3;
      ImuSample sample = World::imu(imu_t_);
      sample.accel = (World::position(warped(imu_t_ - h)) - 2 * World::position(warped(imu_t_)) +
                      World::position(warped(imu_t_ + h))) /
                         (h * h) +
                     gravityVector();
      front_end_.addImu(sample);
    }
    output = front_end_.process({t, world_.image(warped(t)), World::depth(warped(t))});
    EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << t << ' ' << output.frame->status.reason;
    EXPECT_LT((output.frame->state.T_W_I.t() - World::position(warped(t))).norm(), 0.02) << t;
  }
  EXPECT_GT(front_end_.counters().zero_velocity, 40u);
  EXPECT_EQ(output.frame->epoch, 0u);
}

TEST_F(ContradictionTest, ABlowThatTheImuHasOtherwiseIsSeen) {
  run(0.0, 4.01);
  // A false acceleration for 30 ms, 0.3 m/s in all.
  for (int i = 0; i < 6; ++i, imu_t_ += 0.005) {
    ImuSample sample = World::imu(imu_t_);
    sample.accel += Eigen::Vector3d(6.0, 6.0, 5.3);
    front_end_.addImu(sample);
  }
  FrameOutput output;
  for (int k = 80; k < 140; ++k) {
    output = step(0.05 * k);
    EXPECT_LT(error(output), 0.03) << k;
    // Isolated until half a second without the blow has agreed; said at once, and for half a second after that.
    if (k >= 82 && k < 100) {
      EXPECT_NE(output.frame->status.reason.find("the IMU contradicts what is seen"), std::string::npos) << k;
    }
    if (k >= 104) {
      EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << k << ' ' << output.frame->status.reason;
    }
  }
  EXPECT_GE(front_end_.counters().imu_faults, 8u);
  EXPECT_LE(front_end_.counters().imu_faults, 12u);
}

}  // namespace
}  // namespace vip_slam
