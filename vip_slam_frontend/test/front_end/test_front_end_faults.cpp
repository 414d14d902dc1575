// SPDX-License-Identifier: BSD-3-Clause
// The facade with bad input: rejected images, no depth, darkness, changing light, gaps, clock jumps.
#include <cmath>
#include <limits>
#include <vector>

#include "wall_world.h"

namespace vip_slam {
namespace {

TEST_F(FrontEndTest, BadInputIsCountedNamedAndSurvived) {
  run(0.0, 3.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  feedImu(3.1);
  const auto reason = [&](const FrameInput& input) {
    const FrameOutput output = front_end_.process(input);
    EXPECT_EQ(output.keyframe, nullptr);
    EXPECT_NE(output.frame->status.state, TrackingState::kTracking);
    return output.frame->status.reason;
  };
  EXPECT_NE(reason({3.0, cv::Mat(), World::depth(3.0)}).find("empty"), std::string::npos);
  EXPECT_EQ(reason({3.0, cv::Mat(240, 320, CV_8UC3), World::depth(3.0)}), "image is CV_8UC3, expected 8-bit grey");
  EXPECT_NE(reason({3.0, cv::Mat(120, 160, CV_8UC1), World::depth(3.0)}).find("160x120"), std::string::npos);
  EXPECT_EQ(reason({2.95, world_.image(2.95), World::depth(2.95)}), "image stamp 2.950 s does not follow 2.950 s");
  EXPECT_EQ(reason({2.5, world_.image(2.5), World::depth(2.5)}), "image stamp 2.500 s does not follow 2.950 s");
  EXPECT_NE(reason({nan, world_.image(3.0), World::depth(3.0)}).find("finite"), std::string::npos);
  EXPECT_EQ(front_end_.counters().bad_image, 3u);
  EXPECT_EQ(front_end_.counters().bad_stamp, 3u);
  EXPECT_FALSE(front_end_.addImu({3.2, Eigen::Vector3d(nan, 0, 0), gravityVector()}));
  EXPECT_FALSE(front_end_.addImu(World::imu(3.0)));
  EXPECT_GE(front_end_.counters().imu_rejected, 2u);

  // Depth of another size, and depth of NaN and zero, count as none; the pose goes on.
  FrameOutput output = front_end_.process({3.0, world_.image(3.0), cv::Mat(120, 160, CV_32FC1, cv::Scalar(1))});
  EXPECT_EQ(front_end_.counters().bad_depth, 1u);
  cv::Mat holes(240, 320, CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  holes.rowRange(0, 100).setTo(0);
  for (int k = 61; k < 75; ++k) {
    const double t = 0.05 * k;
    feedImu(t);
    output = front_end_.process({t, world_.image(t), holes});
  }
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  output = run(3.75, 5.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.02);
}

TEST_F(FrontEndTest, WithoutDepthItGoesOnDegraded) {
  run(0.0, 3.0);
  const FrameOutput output = run(3.0, 6.0, false, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  EXPECT_NE(output.frame->status.reason.find("no depth"), std::string::npos);
  EXPECT_LT(error(output), 0.06);
}

TEST_F(FrontEndTest, DepthOfEveryFourthImageIsEnough) {
  run(0.0, 3.0);
  FrameOutput output;
  for (int k = 60; k < 140; ++k) {
    output = step(0.05 * k, false, k % 4 == 0);
    EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << k << ' ' << output.frame->status.reason;
    if (output.keyframe) EXPECT_FALSE(output.keyframe->frame.depth_grid.empty()) << k;
  }
  EXPECT_LT(error(output), 0.02);
}

TEST_F(FrontEndTest, DarknessWithoutDepthCoastsWithGrowingCovarianceAndRecovers) {
  FrameOutput output = run(0.0, 3.0);
  const double before = output.frame->covariance(3, 3);
  output = run(3.0, 4.0, true, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  EXPECT_NE(output.frame->status.reason.find("coasting"), std::string::npos);
  EXPECT_GT(output.frame->covariance(3, 3), 2.0 * before);
  EXPECT_LT(error(output), 0.15);
  EXPECT_GT(front_end_.counters().coasting, 10u);
  output = run(4.0, 5.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.15);
}

TEST_F(FrontEndTest, DarknessBeforeACornerIsHeldByDepth) {
  FrameOutput output = run(0.0, 3.0);
  const double before = output.frame->covariance(4, 4);
  for (int k = 60; k < 260; ++k) {
    const double t = 0.05 * k;
    feedImu(t);
    output = front_end_.process({t, cv::Mat(240, 320, CV_8U, cv::Scalar(3)), World::cornerDepth(t)});
    EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  }
  EXPECT_NE(output.frame->status.reason.find("held by depth surfaces"), std::string::npos);
  EXPECT_EQ(front_end_.counters().lost, 0u);
  EXPECT_GT(front_end_.counters().surfaces_used, 200u * 20u);
  // After ten seconds, when the IMU alone is off by metres. No surface constrains the height.
  const Eigen::Vector3d off = output.frame->state.T_W_I.t() - World::position(output.frame->t);
  EXPECT_LT(off.head<2>().norm(), 0.02);
  EXPECT_LT(std::abs(off.z()), 0.1);
  EXPECT_LT(off.z() * off.z(), output.frame->covariance(5, 5));
  EXPECT_LT(output.frame->covariance(4, 4), before + 0.02 * 0.02);
  output = run(13.0, 14.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.02);
}

TEST_F(FrontEndTest, ExposureJumpsDoNotEndTheTracks) {
  run(0.0, 3.0);
  FrameOutput output;
  std::size_t old = 0;
  for (int k = 60; k < 120; ++k) {
    const double t = 0.05 * k;
    feedImu(t);
    cv::Mat image;
    world_.image(t).convertTo(image, CV_8U, k % 10 < 5 ? 1.0 : 0.45);  // twice a second
    output = front_end_.process({t, image, World::depth(t)});
    EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
    old = 0;
    for (const Feature& f : output.frame->features) old += f.age >= 12;
  }
  EXPECT_LT(error(output), 0.015);
  EXPECT_GT(old, 20u);  // tracks that came through at least two jumps
}

TEST_F(FrontEndTest, LowLightAndBlurAreFollowed) {
  run(0.0, 3.0);
  cv::RNG random(11);
  FrameOutput output;
  for (int k = 60; k < 160; ++k) {
    const double t = 0.05 * k;
    feedImu(t);
    cv::Mat image = world_.image(t), noise(image.size(), CV_16S), dim;
    if (k < 110) {
      cv::blur(image, image, cv::Size(9, 3));  // a smear of nine pixels
    } else {
      image.convertTo(dim, CV_16S, 0.06, 2);  // fifteen grey levels remain, with noise of 1.5
      random.fill(noise, cv::RNG::NORMAL, 0, 1.5);
      dim += noise;
      dim.convertTo(image, CV_8U);
    }
    output = front_end_.process({t, image, World::depth(t)});
    EXPECT_NE(output.frame->status.state, TrackingState::kLost) << t;
  }
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.05);
}

TEST_F(FrontEndTest, AfterLostTheOdometryGoesOnWhileTheImuStillTellsWhere) {
  run(0.0, 3.0);
  FrameOutput output = run(3.0, 9.0, true, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kLost);
  EXPECT_EQ(front_end_.counters().lost, 1u);
  const double lost_sigma = std::sqrt(output.frame->covariance(4, 4));
  EXPECT_LT(error(output), 4 * lost_sigma);
  const std::size_t before = keyframes_.size();
  output = run(9.0, 11.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 4 * lost_sigma);
  ASSERT_GT(keyframes_.size(), before);
  EXPECT_EQ(keyframes_[before]->previous, before);  // connected by six seconds of IMU
  EXPECT_FALSE(keyframes_[before]->imu.empty());
}

TEST_F(FrontEndTest, WithoutDepthLostIsLeftAsWell) {
  run(0.0, 3.0);
  run(3.0, 5.0, false, false);
  FrameOutput output = run(5.0, 10.0, true, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kLost);
  const std::size_t before = keyframes_.size();
  output = run(10.0, 12.0, false, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded) << output.frame->status.reason;
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_GT(keyframes_.size(), before);
}

// A hall: depth reaches the floor, which has no texture; textured surfaces are beyond its range.
TEST_F(FrontEndTest, WhereDepthLiesOnSurfacesAloneLostIsLeft) {
  run(0.0, 3.0);
  FrameOutput output = run(3.0, 9.0, true, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kLost);
  for (int k = 180; k < 195; ++k) {
    const double t = 0.05 * k;
    feedImu(t);
    cv::Mat image = world_.image(t), depth = World::cornerDepth(t);
    image.rowRange(120, 240).setTo(90);
    depth.rowRange(0, 125).setTo(0);
    output = front_end_.process({t, image, depth});
  }
  EXPECT_NE(output.frame->status.state, TrackingState::kLost) << output.frame->status.reason;
  EXPECT_EQ(output.frame->epoch, 0u);
}

TEST_F(FrontEndTest, WhatIsSaidIsLostAsLongAsNoKeyframesCome) {
  FrontEndOptions few = options();
  few.tracking.max_features = 15;  // enough to continue, too few to recover from LOST
  FrontEnd front_end(few, sensor());
  for (int k = 0; k < 180; ++k) {
    const double t = 0.05 * k;
    for (; imu_t_ < t + 0.02; imu_t_ += 0.005) {
      ImuSample standing = World::imu(0);
      standing.t = imu_t_;
      front_end.addImu(standing);
    }
    const bool unusable = k >= 60 && k < 150;
    const FrameOutput output =
        front_end.process({t, unusable ? cv::Mat(120, 160, CV_8U) : world_.image(0), World::depth(0)});
    if (k == 59) ASSERT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
    if (k >= 145) EXPECT_EQ(output.frame->status.state, TrackingState::kLost) << k;
  }
}

TEST_F(FrontEndTest, AnImageLongAfterTheImusEndIsFoundByItsOwnPixels) {
  // At 3.5 s it moves at more than 0.5 m/s.
  const FrameOutput before = run(0.0, 3.5);
  const double t = before.frame->t + 0.4;
  const FrameOutput output = front_end_.process({t, world_.image(t), World::depth(t)});
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  EXPECT_NEAR(output.frame->state.t, t, 1e-2);
  ASSERT_GT((output.frame->state.T_W_I.t() - before.frame->state.T_W_I.t()).norm(), 0.1);
  EXPECT_LT(error(output), 0.03);
  EXPECT_LT(error(output), 3 * std::sqrt(output.frame->covariance.block<3, 3>(3, 3).trace()));
}

TEST_F(FrontEndTest, AnIntervalOfOneUlpIsNone) {
  const FrameOutput output = run(0.0, 3.0);
  const double t = output.frame->state.t;
  std::optional<NavState> state;
  ASSERT_NO_THROW(state = front_end_.predict(std::nextafter(t, 1e9)));
  ASSERT_TRUE(state);
  EXPECT_EQ(state->T_W_I.t(), output.frame->state.T_W_I.t());
}

TEST_F(FrontEndTest, WhenTheImuNoLongerTellsWhereANewEpochBegins) {
  FrontEndOptions strict = options();
  strict.recovery.max_position_sigma = 0.05;
  FrontEnd front_end(strict, sensor());
  const auto feed = [&](double from, double to, bool dark) {
    FrameOutput last;
    for (int k = static_cast<int>(std::lround(from * 20)); k < std::lround(to * 20); ++k) {
      const double t = 0.05 * k;
      for (; imu_t_ < t + 0.02; imu_t_ += 0.005) front_end.addImu(World::imu(imu_t_));
      last = front_end.process(
          {t, dark ? cv::Mat(240, 320, CV_8U, cv::Scalar(3)) : world_.image(t), dark ? cv::Mat() : World::depth(t)});
      if (last.keyframe) keyframes_.push_back(last.keyframe);
    }
    return last;
  };
  feed(0.0, 3.0, false);
  FrameOutput output = feed(3.0, 9.0, true);
  EXPECT_EQ(output.frame->status.state, TrackingState::kLost);
  EXPECT_EQ(front_end.counters().lost, 1u);
  const std::size_t before = keyframes_.size();
  output = feed(9.0, 13.0, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
  EXPECT_GE(output.frame->epoch, 1u);
  // It moves steadily when the light returns: the IMU is quiet, but it must not initialise as at rest.
  const double t = output.frame->t, h = 1e-3;
  const double speed = (World::position(t + h) - World::position(t - h)).norm() / (2 * h);
  EXPECT_GT(speed, 0.5);
  EXPECT_NEAR(output.frame->state.v_W.norm(), speed, 0.03);
  ASSERT_GT(keyframes_.size(), before);
  EXPECT_EQ(keyframes_[before]->id, before + 1);  // ids continue
  EXPECT_EQ(keyframes_[before]->previous, 0u);    // nothing ties it to the old epoch
}

TEST_F(FrontEndTest, ImagesThatAreMissingForSecondsAreBridgedByTheImu) {
  run(0.0, 3.0);
  const std::size_t before = keyframes_.size();
  const FrameOutput output = run(6.0, 8.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_EQ(front_end_.counters().restarts, 0u);
  EXPECT_LT(error(output), 0.25);
  EXPECT_LT(error(output), 4 * std::sqrt(output.frame->covariance.block<3, 3>(3, 3).trace()));
  ASSERT_GT(keyframes_.size(), before);
  EXPECT_FALSE(keyframes_[before]->imu.empty());
}

TEST_F(FrontEndTest, ImagesThatAreMissingWhileTheImuTellsNothingStartAnew) {
  FrontEndOptions strict = options();
  strict.recovery.max_position_sigma = 0.05;
  FrontEnd front_end(strict, sensor());
  FrameOutput output;
  for (int k = 0; k <= 61; ++k) {
    const double t = k <= 60 ? 0.05 * k : 8.0;
    for (; imu_t_ < t + 0.02; imu_t_ += 0.005) front_end.addImu(World::imu(imu_t_));
    output = front_end.process({t, world_.image(t), World::depth(t)});
  }
  EXPECT_EQ(output.frame->status.state, TrackingState::kInitialising);
  EXPECT_NE(output.frame->status.reason.find("no image for "), std::string::npos) << output.frame->status.reason;
  EXPECT_EQ(front_end.counters().restarts, 1u);
}

TEST_F(FrontEndTest, WhoStandsBeforeAndAfterAHoleInTheImagesMayHaveMovedInIt) {
  // Dark from 1 s on, so that only the IMU shows rest; a move of 26 cm between the images at 1.3 and 2.5 s.
  FrameOutput output;
  for (double t = 0; t < 3.0; t += 0.05) {
    for (; imu_t_ < t + 0.02; imu_t_ += 0.005) {
      ImuSample sample = World::imu(0);
      sample.t = imu_t_;
      sample.accel.y() += imu_t_ < 1.3501 || imu_t_ > 2.0 ? 0.0 : imu_t_ < 1.6751 ? 2.5 : -2.5;
      front_end_.addImu(sample);
    }
    if (t > 1.32 && t < 2.48) continue;
    const bool dark = t > 1.02;
    output = front_end_.process(
        {t, dark ? cv::Mat(240, 320, CV_8U, cv::Scalar(3)) : world_.image(0), dark ? cv::Mat() : World::depth(0)});
  }
  EXPECT_NEAR(output.frame->state.T_W_I.t().y(), 0.26, 0.05);
}

TEST_F(FrontEndTest, AnImuThatStopsLeavesThePoseToImagesAndDepth) {
  FrameOutput output = run(0.0, 3.0);
  for (int k = 60; k < 120; ++k) {
    const double t = 0.05 * k;
    output = front_end_.process({t, world_.image(t), World::depth(t)});
    EXPECT_LT(error(output), 3 * std::sqrt(output.frame->covariance.block<3, 3>(3, 3).trace()) + 1e-3) << t;
    if (k < 65) continue;
    EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded) << t;
    EXPECT_NE(output.frame->status.reason.find("IMU"), std::string::npos) << output.frame->status.reason;
  }
  EXPECT_LT(error(output), 0.05);
  EXPECT_GE(front_end_.counters().imu_missing, 55u);
  // It comes back.
  imu_t_ = 6.0;
  output = run(6.0, 9.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.05);
}

TEST_F(FrontEndTest, WithoutImuAndLightItIsLost) {
  // A driver that died: a frozen pose must not be published as valid for ever.
  run(0.0, 3.0);
  FrameOutput output;
  for (int k = 60; k < 120; ++k) output = front_end_.process({0.05 * k, cv::Mat(240, 320, CV_8U, cv::Scalar(3)), {}});
  EXPECT_EQ(output.frame->status.state, TrackingState::kLost);
}

TEST_F(FrontEndTest, ImagesThatCannotBeUsedLeaveThePoseToTheImuAndItsGrowingCovariance) {
  FrameOutput output = run(0.0, 3.0);
  const double before = output.frame->covariance(4, 4);
  const auto small = [&](double t) {
    feedImu(t);
    return front_end_.process({t, cv::Mat(120, 160, CV_8UC1, cv::Scalar(90)), cv::Mat()});
  };
  for (int k = 60; k < 80; ++k) output = small(0.05 * k);
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  EXPECT_GT(output.frame->covariance(4, 4), 2.0 * before);
  EXPECT_LT(error(output), 0.15);
  EXPECT_LT(error(output), 4 * std::sqrt(output.frame->covariance.block<3, 3>(3, 3).trace()));
  for (int k = 80; k < 150; ++k) output = small(0.05 * k);
  EXPECT_EQ(output.frame->status.state, TrackingState::kLost);
  EXPECT_NE(output.frame->status.reason.find("160x120"), std::string::npos) << output.frame->status.reason;
  EXPECT_EQ(front_end_.counters().lost, 1u);
  output = run(7.5, 9.5);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
  EXPECT_EQ(output.frame->epoch, 0u);
}

TEST_F(FrontEndTest, ClockRunningBackStartsAnew) {
  run(0.0, 3.0);
  imu_t_ = 0.0;
  const FrameOutput first = step(0.1);
  EXPECT_EQ(first.frame->epoch, 1u);
  EXPECT_NE(first.frame->status.state, TrackingState::kTracking);
  const FrameOutput output = run(0.15, 4.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(output.frame->epoch, 1u);
  EXPECT_LT(error(output), 0.02);
}

// The first accelerometer sample of a device with separate streams has the time of another clock.
TEST_F(FrontEndTest, AFirstSampleFarAheadDoesNotEndASplitImu) {
  const Eigen::Vector3d gyro(0.01, 0, 0), accel(0, 0, 9.81);
  EXPECT_TRUE(front_end_.addAccel(1e6, accel));
  front_end_.clockRanBack("time ran backwards");
  for (int k = 0; k <= 200; ++k) {
    EXPECT_TRUE(front_end_.addGyro(0.005 * k, gyro)) << k;
    EXPECT_TRUE(front_end_.addAccel(0.005 * k, accel)) << k;
  }
  EXPECT_TRUE(front_end_.ready(0.9));
}

TEST_F(FrontEndTest, LongGapOfImuAndImagesRestartsWithItsReason) {
  run(0.0, 3.0);
  imu_t_ = 3.8;
  const FrameOutput output = step(3.9);
  EXPECT_EQ(output.frame->status.state, TrackingState::kInitialising);
  EXPECT_NE(output.frame->status.reason.find("no image for 0.95 s"), std::string::npos) << output.frame->status.reason;
  EXPECT_EQ(front_end_.counters().restarts, 1u);
}

TEST_F(FrontEndTest, ImagesWithinAnImuGapStopNothing) {
  // Between them the IMU is a straight line from the sample before the gap to the one after it.
  for (const double gap : {0.3, 1.0}) {
    FrontEnd front_end(options(), sensor());
    FrameOutput output;
    for (int k = 0; k <= 120; ++k) {
      const double t = 0.05 * k;
      if (k == 0) imu_t_ = 0;
      for (; imu_t_ < t + 0.02; imu_t_ += 0.005) front_end.addImu(World::imu(imu_t_));
      if (k == 60) {
        imu_t_ += gap;
        front_end.addImu(World::imu(imu_t_));
        imu_t_ += 0.005;
      }
      ASSERT_NO_THROW(output = front_end.process({t, world_.image(t), World::depth(t)})) << t;
    }
    EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << gap << ' ' << output.frame->status.reason;
    EXPECT_EQ(front_end.counters().imu_gaps, 1u);
    EXPECT_EQ(front_end.counters().restarts, 0u);
  }
}

}  // namespace
}  // namespace vip_slam
