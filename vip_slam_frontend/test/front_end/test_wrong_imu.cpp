// SPDX-License-Identifier: BSD-3-Clause
// An IMU whose axes or signs differ from the configuration: the poses are wrong, and the status must not be TRACKING.
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "corner_world.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_frontend/front_end.h"

namespace vip_slam {
namespace {

using Fault = std::function<ImuSample(ImuSample)>;

/// What the camera sees at t, with this stamp.
FrameInput seen(const CornerWorld& world, double t, double stamp) {
  FrameInput input;
  input.t = stamp;
  world.look(t, 0, &input.gray, &input.depth);
  return input;
}

struct Verdict {
  std::uint64_t contradicted = 0;  ///< images before which the IMU was at fault, or that contradict it for good
  double farthest = 0;             ///< of the poses from the true ones, m
  int named = 0, silent = 0;       ///< images after 3 s of motion: with the reason given; as TRACKING
};

Verdict judge(const Fault& fault, const SensorConfig& sensor) {
  const CornerWorld world;
  FrontEnd front_end(cornerOptions(), sensor);
  Verdict verdict;
  double imu_t = 0;
  for (int k = 0; k < 160; ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.03; imu_t += 0.005) front_end.addImu(fault(CornerWorld::imu(imu_t)));
    const TrackedFramePtr frame = front_end.process(seen(world, t, t)).frame;
    const TrackingStatus status = frame->status;
    if (t < kStill + 3) continue;
    verdict.farthest = std::max(verdict.farthest, (frame->state.T_W_I.t() - CornerWorld::pose(t).t()).norm());
    verdict.named += status.reason.find("contradict") != std::string::npos;
    verdict.silent += status.state == TrackingState::kTracking;
  }
  verdict.contradicted = front_end.counters().imu_contradicted + front_end.counters().imu_faults;
  return verdict;
}

// A host that stamps images on arrival: 2 ms are two pixels at this rotation rate.
TEST(WrongImu, StampsThatJitterAreNoWrongImu) {
  const CornerWorld world;
  const SensorConfig sensor = cornerSensor(0, 0);
  for (const unsigned seed : {1, 2, 3, 4}) {
    FrontEnd front_end(cornerOptions(), sensor);
    std::mt19937 random(seed);
    std::normal_distribution<double> jitter(0, 0.002);
    double imu_t = 0;
    FrameOutput output;
    for (int k = 0; k < 200; ++k) {
      const double t = 0.05 * k, stamp = t + jitter(random);
      for (; imu_t < t + 0.03; imu_t += 0.005) front_end.addImu(CornerWorld::imu(imu_t));
      output = front_end.process(seen(world, t, stamp));
      if (t < kStill + 3) continue;
      EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << t << ' ' << output.frame->status.reason;
    }
    EXPECT_EQ(front_end.counters().imu_contradicted, 0u) << seed;
    EXPECT_LT((output.frame->state.T_W_I.t() - CornerWorld::pose(output.frame->t).t()).norm(), 0.02) << seed;
  }
}

/// 76 images are evaluated.
void expectNamed(const Fault& fault) {
  const Verdict verdict = judge(fault, cornerSensor(0, 0));
  EXPECT_GT(verdict.contradicted, 20u);
  EXPECT_GT(verdict.named, 20);
  EXPECT_LT(verdict.silent, 8);
  EXPECT_LT(verdict.farthest, 1.5);  // in five seconds; the fault is found while its errors are integrated
}

/// Faults with which tracking itself fails: LOST, coasting, or a rejected initialisation, each with its own reason.
void expectNotTracking(const Fault& fault) { EXPECT_LT(judge(fault, cornerSensor(0, 0)).silent, 8); }

TEST(WrongImu, ReversedAccelerometer) {
  expectNamed([](ImuSample s) {
    s.accel = -s.accel;
    return s;
  });
}

TEST(WrongImu, ReversedGyroscope) {
  expectNotTracking([](ImuSample s) {
    s.gyro = -s.gyro;
    return s;
  });
}

TEST(WrongImu, PermutedAxes) {
  expectNamed([](ImuSample s) {
    s.gyro = Eigen::Vector3d(s.gyro.y(), s.gyro.z(), s.gyro.x());
    s.accel = Eigen::Vector3d(s.accel.y(), s.accel.z(), s.accel.x());
    return s;
  });
}

TEST(WrongImu, LeftHandedAxes) {
  expectNamed([](ImuSample s) {
    s.gyro.y() *= -1;
    s.accel.y() *= -1;
    return s;
  });
}

// A driver that changes its unit on the way: the images carry the pose on from the first image.
TEST(WrongImu, DegreesPerSecondFromTheMiddleOn) {
  const Verdict verdict = judge(
      [](ImuSample s) {
        if (s.t > 5) s.gyro /= kDegree;
        return s;
      },
      cornerSensor(0, 0));
  EXPECT_GT(verdict.named, 40);
  EXPECT_LT(verdict.farthest, 0.05);
}

TEST(WrongImu, DegreesPerSecond) {
  expectNotTracking([](ImuSample s) {
    s.gyro /= kDegree;
    return s;
  });
}

// The images of before hold what the motion was until the fault is found, when what the IMU said of it is refuted.
TEST(WrongImu, WhatAGyroInOtherAxesDidBeforeItWasFoundIsTakenBack) {
  const CornerWorld world;
  FrontEnd front_end(cornerOptions(), cornerSensor(0, 0));
  double imu_t = 0, found = 0, farthest = 0;
  for (int k = 0; k < 100; ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.03; imu_t += 0.005) {
      ImuSample s = CornerWorld::imu(imu_t);
      s.gyro = Eigen::Vector3d(s.gyro.y(), s.gyro.z(), s.gyro.x());
      front_end.addImu(s);
    }
    const TrackedFramePtr frame = front_end.process(seen(world, t, t)).frame;
    if (found == 0 && front_end.counters().imu_faults > 0) found = t;
    if (found == 0) continue;
    const Eigen::Vector3d error = frame->state.T_W_I.t() - CornerWorld::pose(t).t();
    farthest = std::max(farthest, error.norm());
  }
  std::printf("found %.2f s after the motion began; then at most %.1f mm off\n", found - kStill, 1e3 * farthest);
  ASSERT_GT(found, 0.0);
  EXPECT_LT(farthest, 0.006);
}

// A bus that occasionally delivers one wrong sample: 30 m/s^2 for 5 ms are 15 cm/s.
TEST(WrongImu, SingleWrongSamplesDoNotMoveThePose) {
  const CornerWorld world;
  FrontEnd front_end(cornerOptions(), cornerSensor(0, 0));
  double imu_t = 0, wrong_gyro_t = 0;
  int samples = 0;
  std::uint64_t wrong = 0;
  FrameOutput output;
  for (int k = 0; k < 160; ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.03; imu_t += 0.005) {
      ImuSample sample = CornerWorld::imu(imu_t);
      if (++samples % 100 == 50) sample.accel.x() += 30;
      if (samples % 100 == 90) sample.gyro.z() -= 5, wrong_gyro_t = imu_t;
      wrong += samples % 100 == 50 || samples % 100 == 90;
      front_end.addImu(sample);
    }
    output = front_end.process(seen(world, t, t));
    if (t < kStill + 3) continue;
    EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << t << ' ' << output.frame->status.reason;
    EXPECT_LT((output.frame->state.T_W_I.t() - CornerWorld::pose(t).t()).norm(), 0.02) << t;
    // The published twist does not contain them either.
    EXPECT_LT((front_end.gyro(wrong_gyro_t) - CornerWorld::imu(wrong_gyro_t).gyro).norm(), 0.1) << wrong_gyro_t;
  }
  EXPECT_EQ(front_end.counters().imu_spikes, wrong);
  EXPECT_EQ(front_end.counters().imu_contradicted, 0u);
}

/// Calibration errors that the filter learns online, and scale errors of cheap sensors, are no contradiction.
TEST(WrongImu, ModerateErrorsAreNoContradiction) {
  SensorConfig sensor = cornerSensor(0, 0);
  sensor.T_imu_cam = SE3(expQuaternion({0.015, -0.01, 0.01}), {0, 0, 0}) * sensor.T_imu_cam;
  sensor.time_offset = 0.005;
  const Verdict verdict = judge(
      [](ImuSample s) {
        s.accel *= 1.01;
        s.gyro *= 0.99;
        return s;
      },
      sensor);
  EXPECT_EQ(verdict.contradicted, 0u);
}

}  // namespace
}  // namespace vip_slam
