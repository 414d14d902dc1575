// SPDX-License-Identifier: BSD-3-Clause
// Each fault of stamps and clocks, and mixtures: what time messages get, and what is left out. Images of colour and
// depth at 20 Hz and an IMU at 200 Hz over 20 s, with delays as of USB.
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "vip_slam_ros/stream_time/stream_time.h"

namespace vip_slam::stream_time_test {
namespace {

enum { kColor, kDepth, kImu, kStreams };

struct Message {
  std::size_t stream;
  double sent, stamp, arrival;  ///< stamp: negative: lost
};
using Fault = std::function<void(Message*)>;

std::vector<Message> messages(const Fault& fault) {
  std::mt19937 random(1);
  std::exponential_distribution<double> delay(1 / 0.004);
  std::vector<Message> all;
  const auto add = [&](std::size_t stream, double t, double least) {
    Message m{stream, t, t, t + least + delay(random)};
    fault(&m);
    if (m.stamp >= 0) all.push_back(m);
  };
  for (int k = 0; k < 400; ++k) {
    add(kColor, 100 + k / 20.0, 0.02);
    add(kDepth, 100 + k / 20.0, 0.03);
  }
  for (int k = 0; k < 4000; ++k) add(kImu, 100 + k / 200.0, 0.001);
  // Messages of a stream keep their order.
  double newest[kStreams] = {};
  for (Message& m : all) newest[m.stream] = m.arrival = std::max(m.arrival, newest[m.stream] + 1e-5);
  std::stable_sort(all.begin(), all.end(), [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  return all;
}

struct Result {
  std::vector<ClockStep> steps;
  std::vector<double> restarts;
  std::size_t delivered[kStreams] = {}, ahead = 0, stray = 0;
  double worst[kStreams] = {};  ///< largest difference from when messages were sent, of those delivered, s
  bool ordered = true;          ///< times of each stream increase
};

Result run(const std::vector<Message>& all) {
  Result r;
  StreamTime time(kStreams, 1.0,
                  {[&](const ClockStep& step) { r.steps.push_back(step); },
                   [&](double seconds) { r.restarts.push_back(seconds); }});
  double last[kStreams] = {};
  for (const Message& m : all) {
    time.take(m.stream, m.stamp, m.arrival, [&r, &last, m](double t) {
      ++r.delivered[m.stream];
      r.worst[m.stream] = std::max(r.worst[m.stream], std::abs(t - m.sent));
      r.ordered = r.ordered && t > last[m.stream];
      last[m.stream] = t;
    });
  }
  time.end();
  for (std::size_t stream = 0; stream < kStreams; ++stream) {
    r.ahead += time.leftOut(stream).ahead;
    r.stray += time.leftOut(stream).stray;
  }
  return r;
}

Result run(const Fault& fault) { return run(messages(fault)); }

std::size_t all(const Result& r) { return r.delivered[kColor] + r.delivered[kDepth] + r.delivered[kImu]; }

void expectTrueTimes(const Result& r) {
  for (std::size_t stream = 0; stream < kStreams; ++stream) EXPECT_LT(r.worst[stream], 1e-6) << stream;
  EXPECT_TRUE(r.ordered);
  EXPECT_TRUE(r.restarts.empty());
}

TEST(StreamTime, WithoutAFaultEachMessageKeepsItsStamp) {
  const Result r = run([](Message*) {});
  expectTrueTimes(r);
  EXPECT_EQ(all(r), 4800u);
  EXPECT_TRUE(r.steps.empty());
}

TEST(StreamTime, TheMachinesClockThatIsSetIsNamedAndTimeGoesOn) {
  for (const double step : {-0.9, -0.4, -0.1, -0.05, 0.09, 0.5, 86400.0}) {
    SCOPED_TRACE(step);
    const Result r = run([step](Message* m) {
      if (m->sent > 110) m->stamp += step;
    });
    expectTrueTimes(r);
    EXPECT_EQ(all(r), 4800u);
    ASSERT_EQ(r.steps.size(), 1u);
    EXPECT_FALSE(r.steps[0].stream);
    EXPECT_NEAR(r.steps[0].seconds, step, 1e-6);
    EXPECT_NEAR(r.steps[0].time, 110, 0.01);
  }
}

// Recorded or live, where arrival is told by the clock that is set.
TEST(StreamTime, SetBackAlsoWhereArrivalIsSetWithIt) {
  for (const double step : {-0.9, -0.4, -0.1}) {
    SCOPED_TRACE(step);
    std::vector<Message> all_of = messages([step](Message* m) {
      if (m->sent > 110) m->stamp += step;
    });
    for (Message& m : all_of) m.arrival += m.arrival > 110 ? step : 0;
    const Result r = run(all_of);
    expectTrueTimes(r);
    EXPECT_EQ(all(r), 4800u);
    ASSERT_EQ(r.steps.size(), 1u);
    EXPECT_NEAR(r.steps[0].seconds, step, 1e-6);
  }
}

TEST(StreamTime, AheadAndBackAgainIsTheMachinesClockTwice) {
  const Result r = run([](Message* m) {
    if (m->sent > 106 && m->sent < 109) m->stamp += 4.36;
  });
  expectTrueTimes(r);
  EXPECT_EQ(all(r), 4800u);
  ASSERT_EQ(r.steps.size(), 2u);
  EXPECT_NEAR(r.steps[1].seconds, -4.36, 1e-6);
}

TEST(StreamTime, AClockThatIsSetAloneIsFollowed) {
  for (const double step : {-0.3, -0.05, 0.08, 0.6, -5.0, 5.0}) {
    for (const bool imu : {true, false}) {
      SCOPED_TRACE(testing::Message() << step << (imu ? " IMU" : " camera"));
      const Result r = run([step, imu](Message* m) {
        if ((m->stream == kImu) == imu && m->sent > 110) m->stamp += step;
      });
      expectTrueTimes(r);
      EXPECT_EQ(all(r), 4800u);
      ASSERT_EQ(r.steps.size(), imu ? 1u : 2u);
      for (const ClockStep& s : r.steps) {
        EXPECT_EQ(s.stream == std::size_t(kImu), imu);
        EXPECT_NEAR(s.seconds, step, 1e-6);
      }
    }
  }
}

// Recordings whose messages were filed by their stamps know nothing of arrival.
TEST(StreamTime, WithoutAnArrivalNoClockAloneIsFollowed) {
  const Result r = run([](Message* m) {
    if (m->stream == kImu && m->sent > 110) m->stamp -= 0.3;
    m->arrival = m->stamp;
  });
  EXPECT_TRUE(r.steps.empty());
  EXPECT_TRUE(r.restarts.empty());
  EXPECT_EQ(all(r), 4800u);
}

TEST(StreamTime, ASingleStampAheadIsLeftOut) {
  for (const double ahead : {0.08, 0.5, 30.0, 1e6}) {
    for (const std::size_t stream : {std::size_t(kColor), std::size_t(kImu)}) {
      SCOPED_TRACE(testing::Message() << ahead << " stream " << stream);
      int k = 0;
      std::size_t wrong = 0;
      const Result r = run([&](Message* m) {
        if (m->stream != stream || ++k % 40 != 20) return;
        m->stamp += ahead;
        ++wrong;
      });
      expectTrueTimes(r);
      EXPECT_EQ(r.ahead, wrong);
      EXPECT_TRUE(r.steps.empty());
    }
  }
}

TEST(StreamTime, AStampAheadByLessThanAnIntervalIsSeenByItsArrival) {
  int k = 0;
  std::size_t wrong = 0;
  const Result r = run([&](Message* m) {
    if (m->stream != kColor || m->sent < 106 || ++k % 40 != 20) return;
    m->stamp += 0.045;
    ++wrong;
  });
  expectTrueTimes(r);
  EXPECT_EQ(r.ahead, wrong);
  EXPECT_TRUE(r.steps.empty());
}

TEST(StreamTime, AFirstStampAheadIsLeftOut) {
  const Result r = run([](Message* m) {
    if (m->sent < 100.001) m->stamp += 500 + 100 * double(m->stream);
  });
  expectTrueTimes(r);
  EXPECT_EQ(r.ahead, 3u);
}

TEST(StreamTime, AWrongStampFarBackIsLeftOut) {
  int k = 0;
  const Result r = run([&k](Message* m) {
    if (m->stream == kColor && ++k % 40 == 20) m->stamp = 1;
  });
  expectTrueTimes(r);
  EXPECT_EQ(r.stray, 10u);
}

TEST(StreamTime, DelaysAndLossesAreNoSteps) {
  // A busy machine: nothing arrives for 0.4 s, then all at once. Then half a second is lost, then three of four images.
  int k = 0;
  const Result r = run([&k](Message* m) {
    if (m->arrival > 110 && m->arrival < 110.4) m->arrival = 110.4;
    if (m->sent > 112 && m->sent < 112.5) m->stamp = -1;
    if (m->stream != kImu && m->sent > 115 && ++k % 8 > 1) m->stamp = -1;
  });
  expectTrueTimes(r);
  EXPECT_TRUE(r.steps.empty());
  EXPECT_EQ(r.ahead + r.stray, 0u);
  // The IMU is slow to arrive from the start, and at last is not any more, while messages are lost.
  const Result slow = run([](Message* m) {
    if (m->stream == kImu && m->sent < 103.5) m->arrival += 0.1;
    if (m->stream == kImu && m->sent > 103.4 && m->sent < 103.5) m->stamp = -1;
  });
  EXPECT_LT(slow.worst[kColor], 1e-6);
}

TEST(StreamTime, AnotherFrameRateIsNoStep) {
  std::vector<Message> images;
  for (int k = 0; k < 400; ++k) {
    const double t = 100 + (k < 100 ? k / 10.0 : k < 300 ? 10 + (k - 100) / 60.0 : 13.4 + (k - 300) / 5.0);
    for (const std::size_t stream : {std::size_t(kColor), std::size_t(kDepth)}) images.push_back({stream, t, t, t});
  }
  std::size_t most = 0, taken = 0, delivered = 0;
  StreamTime time(kStreams, 1.0, {[](const ClockStep&) { FAIL(); }, [](double) { FAIL(); }});
  for (const Message& m : images) {
    time.take(m.stream, m.stamp, m.arrival, [&](double) { ++delivered; });
    most = std::max(most, ++taken - delivered);
  }
  EXPECT_LE(most, 8u);
  EXPECT_GE(delivered, 798u);
}

TEST(StreamTime, AtAnotherRateArrivalDoesNotTell) {
  const Result r = run([](Message* m) {
    m->arrival *= 0.5;
    if (m->sent > 112 && m->sent < 112.5) m->stamp = -1;
  });
  expectTrueTimes(r);
  EXPECT_TRUE(r.steps.empty());
}

TEST(StreamTime, ALoopingBagRestartsOnceWhateverOrderTheStreamsComeIn) {
  std::vector<Message> rounds;
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 100; ++i) {
      const auto add = [&](std::size_t stream, int of) {
        const double t = 100 + 0.1 * of;
        rounds.push_back({stream, t, t, 10.0 * round + 0.1 * i});
      };
      // The last images of the previous round arrive after the IMU has restarted.
      if (round > 0 && i < 5) add(kColor, 95 + i);
      if (round > 0 && i < 3) add(kDepth, 97 + i);
      add(kImu, i);
      if (i >= 5 || round == 0) add(kColor, i - (round > 0 ? 5 : 0));
      if (i >= 3 || round == 0) add(kDepth, i - (round > 0 ? 3 : 0));
    }
  }
  for (const bool arrival : {false, true}) {
    SCOPED_TRACE(arrival);
    for (Message& m : rounds) m.arrival = arrival ? m.arrival : m.stamp;
    const Result r = run(rounds);
    ASSERT_EQ(r.restarts.size(), 2u);
    EXPECT_NEAR(r.restarts[0], 9.9, 0.3);
    EXPECT_TRUE(r.steps.empty());
    EXPECT_LT(r.worst[kImu], 1e-9);
    EXPECT_EQ(r.delivered[kImu], 300u);
    EXPECT_LE(r.stray, 16u);
  }
}

TEST(StreamTime, APauseOfAllStreamsCostsNothing) {
  const Result r = run([](Message* m) {
    if (m->sent > 110) m->sent += 60, m->stamp += 60, m->arrival += 60;
  });
  expectTrueTimes(r);
  EXPECT_EQ(all(r), 4800u);
  EXPECT_TRUE(r.steps.empty());
}

TEST(StreamTime, AStreamAloneIsBelieved) {
  std::vector<Message> slow;
  for (int k = 0; k < 20; ++k) slow.push_back({kColor, 100 + 3.0 * k, 100 + 3.0 * k, 100 + 3.0 * k});
  const Result r = run(slow);
  expectTrueTimes(r);
  EXPECT_EQ(r.delivered[kColor], 20u);
}

TEST(StreamTime, AMixtureOfFaults) {
  // One image in forty ahead, the IMU's clock set alone at 8 s, the machine's at 14 s, half a second lost between them.
  int k = 0;
  const Result r = run([&k](Message* m) {
    if (m->stream == kImu && m->sent > 108) m->stamp += 0.2;
    if (m->sent > 111 && m->sent < 111.5) m->stamp = -1;
    if (m->stamp > 0 && m->sent > 114) m->stamp -= 0.6;
    if (m->stream == kColor && ++k % 40 == 25) m->stamp += 0.5;
  });
  expectTrueTimes(r);
  ASSERT_EQ(r.steps.size(), 2u);
  EXPECT_EQ(r.steps[0].stream, std::size_t(kImu));
  EXPECT_FALSE(r.steps[1].stream);
  EXPECT_NEAR(r.steps[0].seconds, 0.2, 1e-6);
  EXPECT_NEAR(r.steps[1].seconds, -0.6, 1e-6);
  EXPECT_GE(r.ahead, 9u);
}

}  // namespace
}  // namespace vip_slam::stream_time_test
