// SPDX-License-Identifier: BSD-3-Clause
// Colour and depth are paired by stamp, in whatever order they arrive.
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "vip_slam_ros/image_pairer.h"

namespace vip_slam {
namespace {

cv::Mat image(int value) { return cv::Mat(1, 1, CV_32SC1, cv::Scalar(value)); }
int valueOf(const cv::Mat& m) { return m.empty() ? -1 : m.at<int>(0, 0); }

TEST(ImagePairer, SameStampsPairAtOnce) {
  ImagePairer pairer;
  pairer.addColor(1.0, image(1));
  EXPECT_EQ(pairer.front(), nullptr);
  pairer.addDepth(1.0, image(11));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 1);
  EXPECT_EQ(valueOf(pairer.front()->depth), 11);
  pairer.pop();
  EXPECT_EQ(pairer.front(), nullptr);
  EXPECT_EQ(pairer.counters().pairs, 1u);
}

TEST(ImagePairer, TheStampComesOutAsItWentIn) {
  const std::uint64_t stamp = 1700000000123456789;
  const double t = 1e-9 * double(stamp);
  ImagePairer pairer;
  pairer.addColor(t, image(1), stamp);
  pairer.addDepth(t, image(11));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(pairer.front()->stamp, stamp);
}

TEST(ImagePairer, TheNearestDepthWins) {
  ImagePairer pairer;
  pairer.addDepth(0.990, image(10));
  pairer.addDepth(1.004, image(11));
  pairer.addColor(1.0, image(1));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->depth), 11);
  EXPECT_NEAR(pairer.counters().skew, 0.004, 1e-12);
  EXPECT_NEAR(pairer.front()->depth_lag, 0.004, 1e-12);
  EXPECT_EQ(pairer.counters().unused_depth, 1u);
}

TEST(ImagePairer, AnEarlierDepthWaitsForABetterOne) {
  ImagePairer pairer;
  pairer.addColor(1.0, image(1));
  pairer.addDepth(0.99, image(10));
  EXPECT_EQ(pairer.front(), nullptr);  // 1.001 may still come
  pairer.addDepth(1.03, image(11));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->depth), 10);
}

TEST(ImagePairer, ColourGoesAloneWhenDepthStays) {
  PairerOptions options;
  options.patience = 0.1;
  ImagePairer pairer(options);
  pairer.addColor(1.00, image(1));
  pairer.addColor(1.05, image(2));
  EXPECT_EQ(pairer.front(), nullptr);
  pairer.addColor(1.11, image(3));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 1);
  EXPECT_TRUE(pairer.front()->depth.empty());
  pairer.pop();
  pairer.addDepth(1.11, image(13));
  pairer.addDepth(1.05, image(12));  // older than the last depth: refused
  EXPECT_EQ(pairer.counters().backward, 1u);
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 2);
  EXPECT_TRUE(pairer.front()->depth.empty());
  pairer.pop();
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->depth), 13);
  EXPECT_EQ(pairer.counters().without_depth, 2u);
}

TEST(ImagePairer, MemoryIsBounded) {
  PairerOptions options;
  options.capacity = 3;
  options.patience = 1e9;
  ImagePairer pairer(options);
  for (int i = 0; i < 10; ++i) pairer.addColor(i, image(i));
  EXPECT_EQ(pairer.counters().dropped, 7u);
  pairer.addDepth(7, image(70));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 7);
}

TEST(ImagePairer, RepeatedAndInvalidStampsAreRefused) {
  ImagePairer pairer;
  EXPECT_TRUE(pairer.addColor(1, image(1)));
  EXPECT_FALSE(pairer.addColor(1, image(2)));
  EXPECT_FALSE(pairer.addColor(0.5, image(3)));
  EXPECT_FALSE(pairer.addColor(std::nan(""), image(4)));
  EXPECT_EQ(pairer.counters().backward, 3u);
  pairer.clear();
  EXPECT_TRUE(pairer.addColor(0.5, image(3)));
}

/// Runs colour images 0, 1, ... and those depth images of the same number that `depth_stamp` has, in the order of their
/// stamps; at equal stamps depth first if `depth_first`. Which depth image each colour image got, -1: none.
std::vector<int> pairAll(int images, double interval, bool depth_first,
                         const std::function<std::optional<double>(int)>& depth_stamp) {
  struct Arrival {
    double t;
    bool depth;
    int i;
  };
  std::vector<Arrival> arrivals;
  for (int i = 0; i < images; ++i) {
    arrivals.push_back({i * interval, false, i});
    if (const auto t = depth_stamp(i)) arrivals.push_back({*t, true, i});
  }
  std::sort(arrivals.begin(), arrivals.end(), [&](const Arrival& a, const Arrival& b) {
    return a.t != b.t ? a.t < b.t : a.depth != b.depth && a.depth == depth_first;
  });
  ImagePairer pairer;
  std::vector<int> got(std::size_t(images), -2);
  for (const Arrival& arrival : arrivals) {
    if (arrival.depth) {
      pairer.addDepth(arrival.t, image(arrival.i));
    } else {
      pairer.addColor(arrival.t, image(arrival.i));
    }
    for (; const ImagePair* pair = pairer.front(); pairer.pop()) {
      got[std::size_t(valueOf(pair->gray))] = valueOf(pair->depth);
    }
  }
  return got;
}

TEST(ImagePairer, ALostDepthImageShiftsNoOthers) {
  for (const bool depth_first : {false, true}) {
    const auto got = pairAll(120, 1 / 60.0, depth_first,
                             [](int i) { return i == 10 ? std::nullopt : std::optional<double>(i / 60.0); });
    for (int i = 0; i < 120; ++i) EXPECT_EQ(got[std::size_t(i)], i == 10 ? -1 : i) << depth_first;
  }
}

TEST(ImagePairer, DepthAtHalfTheRateGoesToItsOwnColour) {
  for (const bool depth_first : {false, true}) {
    const auto got = pairAll(121, 1 / 60.0, depth_first,
                             [](int i) { return i % 2 ? std::nullopt : std::optional<double>(i / 60.0); });
    for (int i = 0; i < 121; ++i) EXPECT_EQ(got[std::size_t(i)], i % 2 ? -1 : i) << i << " " << depth_first;
  }
}

TEST(ImagePairer, DepthThatLagsIsNotTakenForTheImageBefore) {
  // 30 Hz depth that is 6 ms later than a 60 Hz colour stream: every other colour image has no depth.
  const auto got = pairAll(121, 1 / 60.0, true,
                           [](int i) { return i % 2 ? std::nullopt : std::optional<double>(i / 60.0 + 0.006); });
  for (int i = 0; i < 121; ++i) EXPECT_EQ(got[std::size_t(i)], i % 2 ? -1 : i) << i;
}

TEST(ImagePairer, JitterLosesNoPair) {
  const auto got = pairAll(120, 1 / 30.0, true, [](int i) { return i / 30.0 + 0.005 * std::sin(2.3 * i); });
  for (int i = 0; i < 119; ++i) EXPECT_EQ(got[std::size_t(i)], i);
}

// A Kinect's depth drifts against its colour: here from 5 to 20 ms behind it, at intervals of 33 ms, so that much of it
// is nearer to the next colour image.
TEST(ImagePairer, DepthThatDriftsPastHalfAnIntervalKeepsItsColour) {
  for (const double sign : {1.0, -1.0}) {
    const auto got = pairAll(700, 1 / 30.0, true, [sign](int i) {
      return i / 30.0 + sign * (0.005 + 0.015 * i / 699 + 0.002 * std::sin(2.3 * i));
    });
    for (int i = 1; i < 699; ++i) EXPECT_EQ(got[std::size_t(i)], i) << sign;
  }
}

// Farther off, a depth image is the next colour image's, and none is given away twice.
TEST(ImagePairer, DepthThatDriftsOnGoesToTheNextColourOnce) {
  const auto got = pairAll(900, 1 / 30.0, true, [](int i) { return i / 30.0 + 0.033 * i / 899; });
  int alone = 0, last = -1;
  for (int i = 0; i < 899; ++i) {
    const int depth = got[std::size_t(i)];
    alone += depth < 0;
    if (depth < 0) continue;
    EXPECT_GT(depth, last) << i;
    EXPECT_LE(i - depth, 1) << i;
    last = depth;
  }
  EXPECT_EQ(last, 897);
  EXPECT_LE(alone, 2);
}

TEST(ImagePairer, ALostDepthImageShiftsNoOthersWhenDepthLags) {
  const auto got = pairAll(120, 1 / 60.0, true,
                           [](int i) { return i == 60 ? std::nullopt : std::optional<double>(i / 60.0 + 0.007); });
  for (int i = 0; i < 119; ++i) EXPECT_EQ(got[std::size_t(i)], i == 60 ? -1 : i) << i;
}

// 25 depth images a second to 30 in colour: each has the nearest, since there is no usual lag.
TEST(ImagePairer, RatesThatDifferPairTheNearest) {
  const auto stamp = [](int i) { return i / 25.0 + 0.004; };
  const auto got = pairAll(300, 1 / 30.0, true,
                           [&](int i) { return stamp(i) < 10 ? std::optional<double>(stamp(i)) : std::nullopt; });
  int pairs = 0;
  for (int i = 0; i < 299; ++i) {
    if (got[std::size_t(i)] < 0) continue;
    ++pairs;
    EXPECT_LE(std::abs(stamp(got[std::size_t(i)]) - i / 30.0), 0.5 / 30 + 1e-9) << i;
  }
  EXPECT_GE(pairs, 248);
}

TEST(ImagePairer, ANearerDepthDoesNotWaitForTheNextColour) {
  ImagePairer pairer;
  for (int i = 0; i < 4; ++i) {
    pairer.addColor(i / 30.0, image(i));
    pairer.addDepth(i / 30.0 + 0.012, image(i));
    if (i == 0) continue;  // the interval is not known yet
    while (pairer.front() && valueOf(pairer.front()->gray) < i) pairer.pop();
    ASSERT_NE(pairer.front(), nullptr) << i;
    EXPECT_EQ(valueOf(pairer.front()->depth), i);
    pairer.pop();
  }
}

// The last image of a recording, whose depth may belong to one that never comes, and one that never had any.
TEST(ImagePairer, WhatWaitsAtTheEndIsHandedOut) {
  ImagePairer pairer;
  pairer.addColor(0.0, image(0));
  pairer.addDepth(0.012, image(0));
  pairer.addColor(0.1, image(1));
  while (pairer.front() && valueOf(pairer.front()->gray) == 0) pairer.pop();
  EXPECT_EQ(pairer.front(), nullptr);
  pairer.addDepth(0.07, image(1));
  pairer.addColor(0.2, image(2));
  EXPECT_EQ(pairer.front(), nullptr);
  pairer.end();
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 1);
  EXPECT_EQ(valueOf(pairer.front()->depth), 1);
  pairer.pop();
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 2);
  EXPECT_TRUE(pairer.front()->depth.empty());
  pairer.pop();
  EXPECT_EQ(pairer.front(), nullptr);
  pairer.clear();
  pairer.addColor(0.3, image(3));
  EXPECT_EQ(pairer.front(), nullptr);
}

TEST(ImagePairer, StreamsThatPartLateAreNoticed) {
  PairerCounters hour_ago, then, now;
  then.pairs = 100000;
  now = then;
  now.without_depth = 30;
  now.pairs += 3;
  EXPECT_FALSE(mostlyUnpaired(hour_ago, then));
  EXPECT_TRUE(mostlyUnpaired(then, now));
  now.pairs += 100;
  EXPECT_FALSE(mostlyUnpaired(then, now));
}

}  // namespace
}  // namespace vip_slam
