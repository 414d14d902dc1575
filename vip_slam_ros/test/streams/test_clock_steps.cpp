// Steps of one device's clock are followed; delays, losses, single wrong stamps and the machine's clock are not.
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_ros/clock_steps.h"

namespace vip_slam::clock_steps_test {
namespace {

enum { kCamera, kImu };

struct Message {
  int stream;
  double sent, stamp, arrival;
};

/// Images at 30 Hz and an IMU at 200 Hz over 20 s, with delays as of USB; in the order of arrival.
std::vector<Message> messages(const std::function<void(Message*)>& change) {
  std::mt19937 random(1);
  std::exponential_distribution<double> delay(1 / 0.004);
  std::vector<Message> all;
  const auto add = [&](int stream, double t, double least) {
    Message m{stream, t, t, t + least + delay(random)};
    change(&m);
    if (m.stamp >= 0) all.push_back(m);
  };
  for (int k = 0; k < 600; ++k) add(kCamera, k / 30.0, 0.02);
  for (int k = 0; k < 4000; ++k) add(kImu, k / 200.0, 0.001);
  // Messages of a stream keep their order.
  double newest[2] = {0, 0};
  for (Message& m : all) newest[m.stream] = m.arrival = std::max(m.arrival, newest[m.stream] + 1e-5);
  std::stable_sort(all.begin(), all.end(), [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  return all;
}

struct Result {
  std::size_t steps = 0, left_out = 0;
  double largest[2] = {0, 0};  ///< difference of stamps from when messages were sent, of those passed on, s
  double seconds = 0;
};

Result run(const std::function<void(Message*)>& change) {
  ClockSteps clock(2, 1.0);
  Result result;
  for (const Message& m : messages(change)) {
    const std::optional<double> t = clock.follow(m.stream, m.stamp, m.arrival);
    if (!t)
      ++result.left_out;
    else
      result.largest[m.stream] = std::max(result.largest[m.stream], std::abs(*t - m.sent));
  }
  result.steps = clock.steps().size();
  if (result.steps > 0) result.seconds = clock.steps().back().seconds;
  return result;
}

TEST(ClockSteps, TheImusClockThatIsSetAloneIsFollowed) {
  for (const double step : {-0.3, -0.05, 0.08, 0.6}) {
    const Result r = run([step](Message* m) {
      if (m->stream == kImu && m->sent > 10) m->stamp += step;
    });
    ASSERT_EQ(r.steps, 1u) << step;
    EXPECT_NEAR(r.seconds, step, 1e-9);
    EXPECT_LT(r.largest[kImu], 1e-9) << step;
    EXPECT_LT(r.largest[kCamera], 1e-9) << step;
    EXPECT_LE(r.left_out, 20u) << step;
  }
}

TEST(ClockSteps, SoIsTheCameras) {
  for (const double step : {-0.3, 0.3}) {
    const Result r = run([step](Message* m) {
      if (m->stream == kCamera && m->sent > 10) m->stamp += step;
    });
    ASSERT_EQ(r.steps, 1u) << step;
    EXPECT_NEAR(r.seconds, step, 1e-9);
    EXPECT_LT(r.largest[kCamera], 1e-9) << step;
    EXPECT_LE(r.left_out, 3u) << step;
  }
}

TEST(ClockSteps, TheMachinesClockIsLeftToOthers) {
  for (const double step : {-0.4, 0.2}) {
    const Result r = run([step](Message* m) {
      if (m->sent > 10) m->stamp += step;
    });
    EXPECT_EQ(r.steps, 0u) << step;
    EXPECT_NEAR(r.largest[kImu], std::abs(step), 1e-9);  // passed on as given
    EXPECT_LE(r.left_out, 40u);
  }
}

TEST(ClockSteps, DelaysAndLossesAreNoSteps) {
  // A busy machine: nothing arrives for 0.4 s, then all at once. Then half a second is lost.
  const Result busy = run([](Message* m) {
    if (m->arrival > 10 && m->arrival < 10.4) m->arrival = 10.4;
    if (m->sent > 12 && m->sent < 12.5) m->stamp = -1;
  });
  EXPECT_EQ(busy.steps, 0u);
  EXPECT_EQ(busy.left_out, 0u);
  // The IMU is slow to arrive from the start, and at last is not any more, while messages are lost.
  const Result slow = run([](Message* m) {
    if (m->stream == kImu && m->sent < 3) m->arrival += 0.1;
    if (m->stream == kImu && m->sent > 2.9 && m->sent < 3) m->stamp = -1;
  });
  EXPECT_EQ(slow.steps, 0u);
  EXPECT_EQ(slow.left_out, 0u);
}

TEST(ClockSteps, ASingleStampAheadIsNoStep) {
  int k = 0;
  const Result r = run([&k](Message* m) {
    if (m->stream == kCamera && ++k % 40 == 0) m->stamp += 0.5;
  });
  EXPECT_EQ(r.steps, 0u);
  EXPECT_LT(r.largest[kImu], 1e-9);
}

TEST(ClockSteps, AtAnotherRateNothingIsFollowed) {
  const Result r = run([](Message* m) {
    m->arrival *= 0.5;
    if (m->sent > 12 && m->sent < 12.5) m->stamp = -1;
  });
  EXPECT_EQ(r.steps, 0u);
  EXPECT_EQ(r.left_out, 0u);
}

// Recordings whose messages were filed by their stamps know nothing of arrival.
TEST(ClockSteps, WithoutAnArrivalNothingIsFollowed) {
  const Result r = run([](Message* m) {
    if (m->stream == kImu && m->sent > 10) m->stamp -= 0.3;
    m->arrival = m->stamp;
  });
  EXPECT_EQ(r.steps, 0u);
}

}  // namespace
}  // namespace vip_slam::clock_steps_test
