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
  int jumps = 0, stragglers = 0;
  const auto notice = [&](std::size_t stream, double t) {
    const Verdict v = clock.notice(stream, t);
    jumps += v == Verdict::kJumpedBack;
    stragglers += v == Verdict::kStraggler;
  };
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 100; ++i) {
      // The last images of the round before arrive when the IMU has begun anew.
      if (round > 0 && i < 5) notice(0, 100 + 0.1 * (95 + i));
      if (round > 0 && i < 3) notice(1, 100 + 0.1 * (97 + i));
      notice(2, 100 + 0.1 * i);
      if (i >= 5 || round == 0) notice(0, 100 + 0.1 * (i - (round > 0 ? 5 : 0)));
      if (i >= 3 || round == 0) notice(1, 100 + 0.1 * (i - (round > 0 ? 3 : 0)));
    }
  }
  EXPECT_EQ(jumps, 2);
  // The first images of the first late batch come before the jump is seen.
  EXPECT_GE(stragglers, 2 * 6);
  EXPECT_LT(clock.newest(), 110.0);
}

TEST(StreamClock, AStreamThatNeverJumpsIsBelievedInTheEnd) {
  StreamClock clock(2, 1.0);
  clock.notice(0, 50);
  clock.notice(1, 50);
  EXPECT_EQ(clock.notice(0, 10), Verdict::kJumpedBack);
  int left_out = 0;
  for (int i = 0; i < 1000; ++i) left_out += clock.notice(1, 50 + 0.01 * i) == Verdict::kStraggler;
  EXPECT_GT(left_out, 0);
  EXPECT_LT(left_out, 300);
}

}  // namespace
}  // namespace vip_slam
