// SPDX-License-Identifier: BSD-3-Clause
// A slow taker costs its own data, counted, and never the giver's time.
#include <chrono>
#include <condition_variable>
#include <future>
#include <numeric>

#include <gtest/gtest.h>

#include "vip_slam_phone/assembly/outbox.h"

namespace vip_slam::phone {
namespace {

Assembled at(double t, bool image) {
  Assembled out;
  out.imu.push_back({t, {}, {}});
  if (image) out.color.push_back({t, cv::Mat(2, 2, CV_8UC3), {}});
  return out;
}

TEST(PhoneOutbox, AllComesInOrder) {
  std::vector<double> imu, color;
  std::promise<void> done;
  Outbox outbox([&](const Assembled& out) {
    for (const ImuSample& s : out.imu) imu.push_back(s.t);
    for (const ImageOut& i : out.color) color.push_back(i.t);
    if (imu.size() == 500) done.set_value();
  });
  for (int i = 0; i < 500; ++i) outbox.add(at(i, false));
  ASSERT_EQ(done.get_future().wait_for(std::chrono::seconds(10)), std::future_status::ready);
  std::vector<double> expected(500);
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(imu, expected);
  EXPECT_EQ(outbox.leftOut().samples, 0u);
}

TEST(PhoneOutbox, WhoTakesNothingLosesTheOldestAndStallsNobody) {
  std::promise<void> held, rest;
  std::shared_future<void> let_go = held.get_future().share();
  std::vector<double> imu, color;
  Outbox outbox([&](const Assembled& out) {
    let_go.wait();
    for (const ImuSample& s : out.imu) imu.push_back(s.t);
    for (const ImageOut& i : out.color) color.push_back(i.t);
    if (imu.back() == 2000) rest.set_value();
  });
  // The first call blocks; it may take more than the first of them with it.
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i <= 2000; ++i) outbox.add(at(i, i % 20 == 0));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  const OutboxCounts left_out = outbox.leftOut();
  held.set_value();
  ASSERT_EQ(rest.get_future().wait_for(std::chrono::seconds(10)), std::future_status::ready);
  EXPECT_EQ(imu.size() + left_out.samples, 2001u);
  EXPECT_EQ(color.size() + left_out.images, 101u);
  EXPECT_GT(left_out.samples, 0u);
  EXPECT_GT(left_out.images, 0u);
  EXPECT_EQ(color.back(), 2000);
  EXPECT_TRUE(std::is_sorted(imu.begin(), imu.end()));
  EXPECT_TRUE(std::is_sorted(color.begin(), color.end()));
}

TEST(PhoneOutbox, EndsWithWorkLeft) {
  std::size_t calls = 0;
  {
    Outbox outbox([&](const Assembled&) {
      ++calls;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    });
    for (int i = 0; i < 100; ++i) outbox.add(at(i, true));
  }
  EXPECT_LE(calls, 2u);
}

}  // namespace
}  // namespace vip_slam::phone
