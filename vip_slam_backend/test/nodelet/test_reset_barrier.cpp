// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "../nodelet/reset_barrier.h"

namespace vip_slam {
namespace {

TEST(ResetBarrier, HoldsBackWhatWasOnItsWay) {
  ResetBarrier barrier;
  EXPECT_TRUE(barrier.passes(0.5, 0));
  barrier.see(12.0, 0);  // device time: seconds since power-up
  barrier.see(11.5, 0);  // keyframes come after later frames
  EXPECT_EQ(barrier.newest(), 12.0);
  barrier.raise();
  EXPECT_FALSE(barrier.passes(11.5, 0));
  EXPECT_FALSE(barrier.passes(12.0, 0));
  EXPECT_TRUE(barrier.passes(12.1, 0));
}

// Images that the front end finishes before it handles the reset have later stamps, but belong to the discarded
// odometry.
TEST(ResetBarrier, AnEpochThatHadKeyframesIsOver) {
  ResetBarrier barrier;
  barrier.seeKeyframe(11.5, 2);
  barrier.see(12.0, 2);
  barrier.raise();
  barrier.seeKeyframe(12.1, 2);
  EXPECT_FALSE(barrier.passes(12.1, 2));
  EXPECT_TRUE(barrier.passes(12.2, 3));
  // Of epoch 3 there are only frames from before initialisation, so the front end keeps that epoch after the reset.
  barrier.see(12.3, 4);
  barrier.raise();
  EXPECT_FALSE(barrier.passes(12.3, 4));
  EXPECT_TRUE(barrier.passes(12.4, 4));
}

TEST(ResetBarrier, ALaterEpochLiftsIt) {
  ResetBarrier barrier;
  barrier.see(12.0, 3);
  barrier.raise();
  EXPECT_FALSE(barrier.passes(0.1, 3));
  EXPECT_TRUE(barrier.passes(0.1, 4));  // the device's clock restarted
  EXPECT_TRUE(barrier.passes(0.2, 4));
}

// The device was reconnected before the reset: the epoch that waits for initialisation has small stamps.
TEST(ResetBarrier, StampsOfEarlierEpochsDoNotCount) {
  ResetBarrier barrier;
  barrier.seeKeyframe(5000.0, 0);
  barrier.see(1.0, 1);
  barrier.see(5000.1, 0);  // was in transit before the reset
  EXPECT_EQ(barrier.newest(), 1.0);
  barrier.raise();
  EXPECT_FALSE(barrier.passes(5000.1, 0));
  EXPECT_FALSE(barrier.passes(1.0, 1));
  EXPECT_TRUE(barrier.passes(1.1, 1));
}

TEST(ResetBarrier, AResetBeforeAnythingCameHoldsNothingBack) {
  ResetBarrier barrier;
  barrier.raise();
  EXPECT_EQ(barrier.newest(), 0.0);
  EXPECT_TRUE(barrier.passes(-5.0, 0));
}

}  // namespace
}  // namespace vip_slam
