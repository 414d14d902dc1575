#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "vip_slam_ros/stream_clock.h"

namespace vip_slam {
namespace {

using Verdict = StreamClock::Verdict;

TEST(StreamClock, LateImagesAreNoJump) {
  StreamClock clock(2, 1.0);
  EXPECT_EQ(clock.notice(0, 10.0), Verdict::kInOrder);
  EXPECT_EQ(clock.notice(1, 13.0), Verdict::kInOrder);
  EXPECT_EQ(clock.notice(0, 10.03), Verdict::kInOrder);
  EXPECT_EQ(clock.notice(1, 12.5), Verdict::kInOrder);  // within the limit
  EXPECT_EQ(clock.newest(), 13.0);
  EXPECT_EQ(clock.newest(0), 10.03);
  EXPECT_EQ(clock.newest(1), 13.0);
}

TEST(StreamClock, ALoopingBagJumpsOnceWhateverOrderTheStreamsComeIn) {
  StreamClock clock(3, 1.0);
  int jumps = 0, strays = 0;
  const auto notice = [&](std::size_t stream, double t) {
    const Verdict v = clock.notice(stream, t);
    jumps += v == Verdict::kJumpedBack;
    strays += v == Verdict::kStray;
  };
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 100; ++i) {
      // The last images of the previous loop arrive after the IMU has restarted.
      if (round > 0 && i < 5) notice(0, 100 + 0.1 * (95 + i));
      if (round > 0 && i < 3) notice(1, 100 + 0.1 * (97 + i));
      notice(2, 100 + 0.1 * i);
      if (i >= 5 || round == 0) notice(0, 100 + 0.1 * (i - (round > 0 ? 5 : 0)));
      if (i >= 3 || round == 0) notice(1, 100 + 0.1 * (i - (round > 0 ? 3 : 0)));
    }
  }
  EXPECT_EQ(jumps, 2);
  // Of each late stream two images come before the jump is certain and four after it; one IMU sample shows it.
  EXPECT_EQ(strays, 2 * 5);
  EXPECT_LT(clock.newest(), 110.0);
}

TEST(StreamClock, AWrongStampNowAndThenIsNoJump) {
  StreamClock clock(2, 1.0);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(clock.notice(1, 50 + 0.01 * i), Verdict::kInOrder);
    EXPECT_EQ(clock.notice(0, 50 + 0.01 * i), Verdict::kInOrder);
    if (i % 10 != 5) continue;
    EXPECT_EQ(clock.notice(0, i % 20 == 5 ? 0.0 : 30 + 0.01 * i), Verdict::kStray);
  }
  EXPECT_EQ(clock.newest(0), 50.99);
}

TEST(StreamClock, AWrongStampFarAheadIsLeftOutAndWhatFollowsIsNoJump) {
  for (const double wrong : {2.0, 30.0, 1e6}) {
    StreamClock clock(2, 1.0);
    for (int i = 0; i < 300; ++i) {
      EXPECT_EQ(clock.notice(1, 50 + 0.01 * i), Verdict::kInOrder) << wrong;
      EXPECT_EQ(clock.notice(0, 50 + 0.01 * i), Verdict::kInOrder) << wrong;
      if (i % 10 == 5) EXPECT_EQ(clock.notice(i % 20 == 5, 50 + 0.01 * i + wrong), Verdict::kStray) << wrong;
    }
    EXPECT_EQ(clock.newest(), 52.99);
  }
}

TEST(StreamClock, APauseOfAllStreamsCostsOneMessage) {
  StreamClock clock(3, 1.0);
  for (std::size_t stream = 0; stream < 3; ++stream) clock.notice(stream, 10.0);
  EXPECT_EQ(clock.notice(1, 60.0), Verdict::kStray);
  EXPECT_EQ(clock.notice(1, 60.01), Verdict::kInOrder);
  EXPECT_EQ(clock.notice(0, 60.02), Verdict::kInOrder);  // the other stream has shown that time advanced
  EXPECT_EQ(clock.notice(1, 60.02), Verdict::kInOrder);
  EXPECT_EQ(clock.notice(2, 60.0), Verdict::kInOrder);
  // A stream that comes once in three seconds, alone.
  EXPECT_EQ(clock.notice(0, 63.0), Verdict::kStray);
  EXPECT_EQ(clock.notice(0, 66.0), Verdict::kInOrder);
}

TEST(StreamClock, AStreamThatNeverJumpsIsBelievedInTheEnd) {
  StreamClock clock(2, 1.0);
  clock.notice(0, 50);
  clock.notice(1, 50);
  EXPECT_EQ(clock.notice(0, 10), Verdict::kStray);
  EXPECT_EQ(clock.notice(0, 10.1), Verdict::kJumpedBack);
  int left_out = 0;
  for (int i = 0; i < 1000; ++i) left_out += clock.notice(1, 50 + 0.01 * i) == Verdict::kStray;
  EXPECT_GT(left_out, 0);
  EXPECT_LT(left_out, 300);
}

/// An IMU at 200 Hz, colour at 30 and depth at 15 Hz, whose stamps change by `step` from 3 s on where `steps` has their
/// number. Returns the sizes of the steps of the clock that were found.
std::vector<double> stepsOfClock(double step, const std::vector<std::size_t>& steps, bool only_once = false) {
  StreamClock clock(3, 1.0);
  std::vector<double> jumps;
  bool stepped[3] = {};
  for (int i = 0; i < 1200; ++i) {
    const double t = 0.005 * i;
    for (std::size_t stream = 0; stream < 3; ++stream) {
      const int every[] = {1, 7, 14};
      if (i % every[stream] != 0) continue;
      const bool shifted =
          t > 3 && std::find(steps.begin(), steps.end(), stream) != steps.end() && !(only_once && stepped[stream]);
      stepped[stream] = stepped[stream] || shifted;
      if (clock.notice(stream, 100 + t + (shifted ? step : 0)) == Verdict::kSetBack) jumps.push_back(clock.lastJump());
    }
  }
  return jumps;
}

TEST(StreamClock, AStepBackThatAllStreamsMakeTogetherIsAClockThatWasSet) {
  for (const double step : {-0.06, -0.1, -0.4, -0.9}) {
    const std::vector<double> jumps = stepsOfClock(step, {0, 1, 2});
    ASSERT_EQ(jumps.size(), 1u) << step;
    EXPECT_NEAR(jumps[0], -step, 0.01) << step;
  }
}

TEST(StreamClock, AStepOfOneStreamOrOfOneStampIsNoClockThatWasSet) {
  for (const double step : {-0.4, -0.1, 0.08, 0.5}) {
    EXPECT_TRUE(stepsOfClock(step, {0}).empty()) << step;
    EXPECT_TRUE(stepsOfClock(step, {1, 2}).empty()) << step;
  }
  for (const double ahead : {0.08, 0.5}) EXPECT_TRUE(stepsOfClock(ahead, {0, 1, 2}, true).empty()) << ahead;
}

}  // namespace
}  // namespace vip_slam
