// SPDX-License-Identifier: BSD-3-Clause
// Why colour and depth are not paired by message_filters' ApproximateTime: the same streams through both. What the
// figures mean for the odometry is in docs/dependencies.md.
#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/synchronizer.h>
#include <sensor_msgs/Image.h>
#include <boost/bind/bind.hpp>
#include <boost/make_shared.hpp>

#include "vip_slam_ros/image_pairer.h"

namespace vip_slam {
namespace {

constexpr double kPeriod = 1 / 30.0;
constexpr int kImages = 90;

struct Outcome {
  int depth = -1;    ///< number of its depth image
  double delay = 0;  ///< from the image's stamp until the pair is handed out, s
};
using Outcomes = std::map<int, Outcome>;  ///< by the number of the colour image

struct Arrival {
  double t;
  bool depth;
  int i;
};

/// Colour images at 30 Hz and those of depth that `depth_stamp` gives, each arriving at its stamp.
std::vector<Arrival> arrivals(const std::function<std::optional<double>(int)>& depth_stamp) {
  std::vector<Arrival> all;
  for (int i = 0; i < kImages; ++i) {
    all.push_back({1 + i * kPeriod, false, i});
    if (const auto t = depth_stamp(i)) all.push_back({1 + *t, true, i});
  }
  std::sort(all.begin(), all.end(), [](const Arrival& a, const Arrival& b) { return a.t < b.t; });
  return all;
}

Outcomes byPairer(const std::vector<Arrival>& arrivals) {
  ImagePairer pairer;
  Outcomes out;
  for (const Arrival& a : arrivals) {
    const cv::Mat image(1, 1, CV_32SC1, cv::Scalar(a.i));
    a.depth ? pairer.addDepth(a.t, image) : pairer.addColor(a.t, image);
    for (; const ImagePair* pair = pairer.front(); pairer.pop())
      out[pair->gray.at<int>(0)] = {pair->depth.empty() ? -1 : pair->depth.at<int>(0), a.t - pair->t};
  }
  return out;
}

Outcomes byApproximateTime(const std::vector<Arrival>& arrivals) {
  using Policy = message_filters::sync_policies::ApproximateTime<sensor_msgs::Image, sensor_msgs::Image>;
  ros::Time::init();
  Policy policy(20);
  policy.setMaxIntervalDuration(ros::Duration(PairerOptions().tolerance));
  message_filters::Synchronizer<Policy> sync(policy);
  Outcomes out;
  double now = 0;
  const auto take = [&](const sensor_msgs::ImageConstPtr& color, const sensor_msgs::ImageConstPtr& depth) {
    out[int(color->header.seq)] = {int(depth->header.seq), now - color->header.stamp.toSec()};
  };
  sync.registerCallback(boost::bind<void>(take, boost::placeholders::_1, boost::placeholders::_2));
  for (const Arrival& a : arrivals) {
    now = a.t;
    const auto image = boost::make_shared<sensor_msgs::Image>();
    image->header.seq = std::uint32_t(a.i);
    image->header.stamp = ros::Time(a.t);
    if (a.depth)
      sync.add<1>(sensor_msgs::ImageConstPtr(image));
    else
      sync.add<0>(sensor_msgs::ImageConstPtr(image));
  }
  return out;
}

double longestDelay(const Outcomes& outcomes, int from, int to) {
  double longest = 0;
  for (const auto& [i, outcome] : outcomes)
    if (i >= from && i < to) longest = std::max(longest, outcome.delay);
  return longest;
}

// Cameras without synchronisation: it has to see the next image to know that no pair is better.
TEST(ApproximateTime, WaitsForTheNextImageWherePairsAreNotExact) {
  const auto stream = arrivals([](int i) { return i * kPeriod + 0.005; });
  const Outcomes ours = byPairer(stream), theirs = byApproximateTime(stream);
  for (int i = 5; i < kImages - 2; ++i) {
    EXPECT_EQ(ours.at(i).depth, i);
    EXPECT_EQ(theirs.at(i).depth, i);
  }
  EXPECT_NEAR(longestDelay(ours, 5, kImages - 2), 0.005, 1e-6);
  EXPECT_NEAR(longestDelay(theirs, 5, kImages - 2), kPeriod, 1e-6);
}

// Depth that stays away for a second (a stall of the USB bus, an emitter that is switched): no image is handed out.
TEST(ApproximateTime, HandsOutNothingWithoutDepth) {
  const auto stream =
      arrivals([](int i) { return i >= 30 && i < 60 ? std::nullopt : std::optional<double>(i * kPeriod); });
  const Outcomes ours = byPairer(stream), theirs = byApproximateTime(stream);
  for (int i = 30; i < 60; ++i) {
    EXPECT_EQ(ours.at(i).depth, -1) << i;
    EXPECT_EQ(theirs.count(i), 0u) << i;
  }
  EXPECT_LT(longestDelay(ours, 30, 60), PairerOptions().patience + 1.5 * kPeriod);
}

// Depth at half the rate: every second image has none, and the odometry would run at half the rate.
TEST(ApproximateTime, HalvesTheRateOfTheImagesWithThatOfTheDepth) {
  const auto stream = arrivals([](int i) { return i % 2 ? std::nullopt : std::optional<double>(i * kPeriod + 1e-4); });
  const Outcomes ours = byPairer(stream), theirs = byApproximateTime(stream);
  for (int i = 4; i < kImages - 6; ++i) {
    EXPECT_EQ(ours.at(i).depth, i % 2 ? -1 : i) << i;
    EXPECT_EQ(theirs.count(i), i % 2 ? 0u : 1u) << i;
  }
}

// Exact stamps are no case for or against: both hand a pair out as soon as it is there.
TEST(ApproximateTime, IsAsGoodWhereStampsAreEqual) {
  const auto stream = arrivals([](int i) { return i * kPeriod; });
  const Outcomes ours = byPairer(stream), theirs = byApproximateTime(stream);
  for (int i = 0; i < kImages; ++i) {
    EXPECT_EQ(ours.at(i).depth, i);
    EXPECT_EQ(theirs.at(i).depth, i);
    EXPECT_NEAR(ours.at(i).delay, theirs.at(i).delay, 2e-9);
  }
}

}  // namespace
}  // namespace vip_slam
