// SPDX-License-Identifier: BSD-3-Clause
// Single wrong samples of the IMU: replaced, counted; vibration, shocks, gaps and ordinary motion are left alone.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "vip_slam_core/imu/imu_buffer.h"

namespace vip_slam {
namespace {

constexpr double kStep = 0.005;

/// Carried in the hand: turns, sways, and the noise of a cheap IMU.
class Hand {
 public:
  ImuSample operator()(double t) {
    ImuSample s = smooth(t);
    for (int k = 0; k < 3; ++k) {
      s.gyro[k] += 0.004 * normal_(random_);
      s.accel[k] += 0.04 * normal_(random_);
    }
    return s;
  }
  static ImuSample smooth(double t) {
    const double w = 2 * M_PI * 1.3;
    return {t,
            {0.8 * std::sin(w * t), 0.3 * std::cos(w * t), 0.5 * std::sin(0.7 * w * t)},
            {1.5 * std::sin(2 * w * t), std::cos(w * t), 9.81 + 2 * std::sin(w * t)}};
  }

 private:
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_;
};

using Disturbance = std::function<void(int, ImuSample*)>;

/// Sixty seconds of it; a stamp below zero leaves the sample out.
std::size_t spikesIn(const Disturbance& disturb, double step = kStep) {
  ImuBuffer buffer(0.05, 1e9);
  Hand hand;
  for (int k = 0; k * step < 60; ++k) {
    ImuSample s = hand(k * step);
    disturb(k, &s);
    if (s.t >= 0) buffer.add(s);
  }
  return buffer.counters().spikes;
}

TEST(SpikeFilterTest, SpikesAreReplacedByTheLineBetweenTheirNeighbours) {
  ImuBuffer buffer(0.05, 1e9);
  Hand hand;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> size(6, 30);
  std::size_t put = 0;
  for (int k = 0; k < 12000; ++k) {
    ImuSample s = hand(kStep * k);
    if (k % 700 == 350) s.accel.x() += (k % 1400 == 350 ? 1 : -1) * size(random);
    if (k % 700 == 500) s.gyro.z() += 0.2 * size(random);
    if (k % 700 == 660 || k % 700 == 662) s.accel.y() += 156;  // one sound sample in between
    const int phase = k % 700;
    put += phase == 350 || phase == 500 || phase == 660 || phase == 662;
    ASSERT_TRUE(buffer.add(s));
  }
  EXPECT_EQ(buffer.counters().spikes, put);
  EXPECT_EQ(buffer.counters().accepted, 12000u);
  EXPECT_EQ(buffer.size(), 12000u);
  for (const ImuSample& s : buffer.between(buffer.oldest(), buffer.newest())) {
    EXPECT_LT((s.accel - Hand::smooth(s.t).accel).norm(), 0.5) << s.t;
    EXPECT_LT((s.gyro - Hand::smooth(s.t).gyro).norm(), 0.06) << s.t;
  }
}

TEST(SpikeFilterTest, SpikesOfSplitStreamsAreTakenOutBeforeTheyAreJoined) {
  ImuBuffer buffer(0.05, 1e9);
  Hand hand;
  for (int k = 0; k < 4000; ++k) {  // 400 Hz and 100 Hz
    ImuSample s = hand(0.0025 * k);
    if (k % 400 == 200) s.accel.z() += 25;
    if (k % 400 == 301) s.gyro.y() -= 4;
    if (k % 4 == 0) buffer.addAccel(s.t, s.accel);
    buffer.addGyro(s.t, s.gyro);
  }
  EXPECT_EQ(buffer.counters().spikes, 20u);
  EXPECT_GT(buffer.size(), 3900u);
  for (const ImuSample& s : buffer.between(buffer.oldest(), buffer.newest())) {
    EXPECT_LT((s.accel - Hand::smooth(s.t).accel).norm(), 0.5) << s.t;
    EXPECT_LT((s.gyro - Hand::smooth(s.t).gyro).norm(), 0.06) << s.t;
  }
}

TEST(SpikeFilterTest, OnlyASuspectWaitsAndOnlyForTheNextSample) {
  ImuBuffer buffer;
  int k = 0;
  for (; k < 100; ++k) {
    ASSERT_TRUE(buffer.add(Hand::smooth(kStep * k)));
    if (k > 0) {  // the very first waits as well
      EXPECT_EQ(buffer.newest(), kStep * k);
    }
  }
  ImuSample spike = Hand::smooth(kStep * k);
  spike.accel.x() += 20;
  EXPECT_TRUE(buffer.add(spike));
  EXPECT_EQ(buffer.newest(), kStep * (k - 1));
  EXPECT_FALSE(buffer.add(spike));  // it is in the buffer nevertheless
  EXPECT_EQ(buffer.counters().duplicate, 1u);
  EXPECT_TRUE(buffer.add(Hand::smooth(kStep * ++k)));
  EXPECT_EQ(buffer.newest(), kStep * k);
  EXPECT_EQ(buffer.counters().spikes, 1u);
}

TEST(SpikeFilterTest, VibrationIsNone) {
  for (const double hertz : {50.0, 61.0, 83.0, 97.0, 99.9, 100.0}) {  // 50: every other sample is zero
    for (const double size : {2.0, 10.0, 40.0}) {
      const auto rotor = [&](int k, ImuSample* s) {
        const double on = std::min(1.0, std::max(0, k - 2000) / 40.0), phase = 2 * M_PI * hertz * kStep * k;
        s->accel.z() += on * size * std::sin(phase);
        s->accel.x() += 0.6 * on * size * std::sin(phase + 1);
        s->gyro.y() += 0.05 * on * size * std::sin(phase);
      };
      EXPECT_EQ(spikesIn(rotor), 0u) << hertz << " Hz, " << size << " m/s^2";
    }
  }
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  EXPECT_EQ(spikesIn([&](int, ImuSample* s) {
              for (int a = 0; a < 3; ++a) s->accel[a] += 6 * normal(random), s->gyro[a] += 0.4 * normal(random);
            }),
            0u);
}

TEST(SpikeFilterTest, ShocksAreNone) {
  // Half a sine of two to eight samples, and what rings on after it.
  for (int length = 2; length <= 8; ++length) {
    for (const double size : {5.0, 20.0, 80.0}) {
      const auto shock = [&](int k, ImuSample* s) {
        const int since = k % 500 - 250;
        if (since >= 0 && since < length) s->accel.z() += size * std::sin(M_PI * (since + 0.5) / length);
      };
      EXPECT_EQ(spikesIn(shock), 0u) << length << " samples, " << size << " m/s^2";
    }
  }
  for (const double hertz : {30.0, 47.0, 80.0}) {
    const auto step = [&](int k, ImuSample* s) {  // a foot that is set down
      const double since = kStep * (k % 140);
      s->accel.z() += 25 * std::exp(-since / 0.03) * std::cos(2 * M_PI * hertz * since);
      s->gyro.x() += 1.5 * std::exp(-since / 0.03) * std::sin(2 * M_PI * hertz * since);
    };
    EXPECT_EQ(spikesIn(step), 0u) << hertz << " Hz";
  }
}

TEST(SpikeFilterTest, GapsAndAbruptStepsAreNone) {
  std::mt19937 random(9);
  EXPECT_EQ(spikesIn([&](int k, ImuSample* s) {
              if (random() % 10 == 0 || k % 1000 > 990) s->t = -1;
            }),
            0u);
  EXPECT_EQ(spikesIn([](int, ImuSample*) {}, 0.01), 0u);
  EXPECT_EQ(spikesIn([](int k, ImuSample* s) { s->accel.x() += k % 200 < 100 ? 8 : 0; }), 0u);
  // A single sample between two gaps cannot be checked against neighbours.
  EXPECT_EQ(spikesIn([](int k, ImuSample* s) {
              const int at = k % 400;
              if (at > 100 && at < 120 && at != 110) s->t = -1;
              if (at == 110) s->accel.x() += 8;
            }),
            0u);
}

}  // namespace
}  // namespace vip_slam
