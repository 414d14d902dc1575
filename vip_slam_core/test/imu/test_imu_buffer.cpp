// SPDX-License-Identifier: BSD-3-Clause
// The IMU buffer: interpolated ends, gaps, out-of-order samples, split streams, bounded memory.
#include <gtest/gtest.h>

#include "vip_slam_core/imu/imu_buffer.h"

namespace vip_slam {
namespace {

ImuSample at(double t) {
  ImuSample s;
  s.t = t;
  s.gyro = Eigen::Vector3d(t, 2 * t, -t);
  s.accel = Eigen::Vector3d(1 + t, 0, 9.81 - t);
  return s;
}

void fill(ImuBuffer* buffer, double t0, double t1, double dt) {
  for (int k = 0; t0 + k * dt <= t1 + 1e-9; ++k) ASSERT_TRUE(buffer->add(at(t0 + k * dt)));
}

TEST(ImuBufferTest, EndsAreInterpolated) {
  ImuBuffer buffer;
  fill(&buffer, 1.0, 2.0, 0.01);
  double gap = -1;
  const auto samples = buffer.between(1.103, 1.247, &gap);
  ASSERT_EQ(samples.size(), 16u);  // 1.11 ... 1.24 and both ends
  EXPECT_DOUBLE_EQ(samples.front().t, 1.103);
  EXPECT_DOUBLE_EQ(samples.back().t, 1.247);
  EXPECT_NEAR(gap, 0.01, 1e-9);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    EXPECT_LT((samples[k].gyro - at(samples[k].t).gyro).norm(), 1e-12);  // linear data: interpolation is exact
    EXPECT_LT((samples[k].accel - at(samples[k].t).accel).norm(), 1e-12);
    if (k > 0) {
      EXPECT_GT(samples[k].t, samples[k - 1].t);
    }
  }
}

TEST(ImuBufferTest, EndsOnSamplesAreNotDoubled) {
  ImuBuffer buffer;
  for (int k = 0; k <= 8; ++k) buffer.add(at(0.125 * k));
  const auto samples = buffer.between(0.25, 0.75);
  ASSERT_EQ(samples.size(), 5u);
  EXPECT_EQ(samples.front().t, 0.25);
  EXPECT_EQ(samples.back().t, 0.75);
  const auto inside = buffer.between(0.26, 0.27);  // within one step
  ASSERT_EQ(inside.size(), 2u);
  EXPECT_EQ(inside[0].t, 0.26);
  EXPECT_EQ(inside[1].t, 0.27);
  EXPECT_EQ(buffer.between(0, 1).size(), 9u);
}

TEST(ImuBufferTest, NothingWhereNotCovered) {
  ImuBuffer buffer;
  EXPECT_TRUE(buffer.between(0, 1).empty());
  EXPECT_FALSE(buffer.at(0));
  fill(&buffer, 1, 2, 0.01);
  EXPECT_TRUE(buffer.between(0.9, 1.5).empty());
  EXPECT_TRUE(buffer.between(1.5, 2.1).empty());
  EXPECT_TRUE(buffer.between(1.5, 1.5).empty());
  EXPECT_TRUE(buffer.between(1.6, 1.5).empty());
  EXPECT_FALSE(buffer.at(2.1));
  ASSERT_TRUE(buffer.at(1.2345));
  EXPECT_LT((buffer.at(1.2345)->gyro - at(1.2345).gyro).norm(), 1e-12);
  EXPECT_TRUE(buffer.covers(1.0));
  EXPECT_FALSE(buffer.covers(0.999));
}

TEST(ImuBufferTest, DisorderRepetitionAndNonsenseAreCounted) {
  ImuBuffer buffer;
  EXPECT_TRUE(buffer.add(at(0.99)));
  EXPECT_TRUE(buffer.add(at(1.0)));
  EXPECT_FALSE(buffer.add(at(1.0)));
  EXPECT_FALSE(buffer.add(at(0.9)));
  ImuSample bad = at(1.1);
  bad.gyro.x() = NAN;
  EXPECT_FALSE(buffer.add(bad));
  bad = at(INFINITY);
  EXPECT_FALSE(buffer.add(bad));
  EXPECT_TRUE(buffer.add(at(1.01)));
  EXPECT_EQ(buffer.counters().accepted, 3u);
  EXPECT_EQ(buffer.counters().duplicate, 1u);
  EXPECT_EQ(buffer.counters().out_of_order, 1u);
  EXPECT_EQ(buffer.counters().not_finite, 2u);
  EXPECT_EQ(buffer.size(), 3u);
}

TEST(ImuBufferTest, GapsAreCountedAndSeenFromInside) {
  ImuBuffer buffer(0.05);
  fill(&buffer, 0, 1, 0.01);
  fill(&buffer, 1.3, 2, 0.01);
  EXPECT_EQ(buffer.counters().gaps, 1u);
  double gap = 0;
  buffer.between(0.5, 1.5, &gap);
  EXPECT_NEAR(gap, 0.3, 1e-9);
  buffer.between(0.5, 1.1, &gap);  // the end interpolated inside the gap must not hide it
  EXPECT_NEAR(gap, 0.3, 1e-9);
  buffer.between(1.2, 1.5, &gap);
  EXPECT_NEAR(gap, 0.3, 1e-9);
  buffer.between(0.2, 0.6, &gap);
  EXPECT_NEAR(gap, 0.01, 1e-9);
}

TEST(ImuBufferTest, MemoryIsBounded) {
  ImuBuffer buffer(0.05, 2.0);
  fill(&buffer, 0, 10, 0.01);
  EXPECT_LE(buffer.size(), 202u);
  EXPECT_GE(buffer.oldest(), 8.0 - 1e-9);
  buffer.dropBefore(9.005);
  EXPECT_NEAR(buffer.oldest(), 9.0, 1e-9);  // one sample before stays, for interpolation
  EXPECT_TRUE(buffer.at(9.005));
  buffer.clear();
  EXPECT_TRUE(buffer.empty());
  ImuBuffer lonely(0.05, 2.0);
  for (int k = 0; k < 100000; ++k) lonely.addGyro(0.01 * k, {1, 2, 3});
  EXPECT_TRUE(lonely.empty());  // an accelerometer that never comes
}

TEST(ImuBufferTest, SplitStreamsAreJoinedOnTheGyroStamps) {
  ImuBuffer buffer(0.05);
  // Gyro at 200 Hz, accelerometer at 63 Hz with another phase, accelerometer arriving late.
  std::size_t a = 0;
  for (int k = 0; k <= 400; ++k) {
    const double t = 0.005 * k;
    ASSERT_TRUE(buffer.addGyro(t, at(t).gyro));
    while (0.007 + a / 63.0 < t - 0.03) {
      ASSERT_TRUE(buffer.addAccel(0.007 + a / 63.0, at(0.007 + a / 63.0).accel));
      ++a;
    }
  }
  ASSERT_GT(buffer.size(), 350u);
  for (double t = buffer.oldest(); t <= buffer.newest(); t += 0.013) {
    ASSERT_TRUE(buffer.at(t));
    EXPECT_LT((buffer.at(t)->gyro - at(t).gyro).norm(), 1e-9);
    EXPECT_LT((buffer.at(t)->accel - at(t).accel).norm(), 1e-9);
  }
  EXPECT_GE(buffer.oldest(), 0.007);
  EXPECT_LE(buffer.newest(), 0.007 + (a - 1) / 63.0);
  EXPECT_EQ(buffer.counters().gaps, 0u);
}

TEST(ImuBufferTest, AHoleInTheAccelerometerAloneIsAGap) {
  ImuBuffer buffer(0.05);
  for (int k = 0; k < 400; ++k) {
    const double t = 0.005 * k;
    buffer.addGyro(t, at(t).gyro);
    if (k % 2 == 0 && !(t > 1.0 && t < 1.8)) buffer.addAccel(t, at(t).accel);
  }
  EXPECT_EQ(buffer.counters().gaps, 1u);
  double gap = 0;
  buffer.between(0.5, 1.9, &gap);
  EXPECT_NEAR(gap, 0.8, 0.011);
}

TEST(ImuBufferTest, SplitStreamsRefuseDisorderToo) {
  ImuBuffer buffer(0.2);
  EXPECT_TRUE(buffer.addAccel(0.95, {0, 0, 9.81}));
  EXPECT_TRUE(buffer.addAccel(1.0, {0, 0, 9.81}));
  EXPECT_FALSE(buffer.addAccel(0.9, {0, 0, 9.81}));
  EXPECT_FALSE(buffer.addAccel(1.0, {0, 0, 9.81}));
  EXPECT_FALSE(buffer.addAccel(1.1, {0, 0, NAN}));
  EXPECT_TRUE(buffer.addAccel(1.1, {0, 0, 9.81}));
  EXPECT_TRUE(buffer.addGyro(1.04, {0, 0, 0}));  // accelerometer samples on both sides: combined at once
  EXPECT_EQ(buffer.size(), 1u);
  EXPECT_TRUE(buffer.addGyro(1.05, {0, 0, 0}));
  EXPECT_EQ(buffer.size(), 2u);
  EXPECT_FALSE(buffer.addGyro(1.05, {0, 0, 0}));
  EXPECT_FALSE(buffer.addGyro(1.01, {0, 0, 0}));
  EXPECT_EQ(buffer.counters().out_of_order, 2u);
  EXPECT_EQ(buffer.counters().duplicate, 2u);
  EXPECT_EQ(buffer.counters().not_finite, 1u);
}

TEST(ImuBuffer, SamplesOfABusThatFailsAreRefused) {
  ImuBuffer buffer;
  const Eigen::Vector3d up(0, 0, 9.8), none = Eigen::Vector3d::Zero();
  EXPECT_TRUE(buffer.add({0.000, none, up}));  // a body at rest, its gyro rounded to zero
  EXPECT_FALSE(buffer.add({0.005, none, none}));
  EXPECT_TRUE(buffer.add({0.010, none, up}));
  EXPECT_EQ(buffer.counters().not_finite, 1u);
}

}  // namespace
}  // namespace vip_slam
