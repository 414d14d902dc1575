// SPDX-License-Identifier: BSD-3-Clause
// What a run says of the states that its images were in.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "vip_slam_bringup/runner/run_output.h"

namespace vip_slam {
namespace {

StateChange stretch(double t, TrackingState state, std::size_t images, const std::string& reason) {
  StateChange change;
  change.t = t;
  change.status.state = state;
  change.status.reason = reason;
  change.images = images;
  return change;
}

TEST(OtherStates, AreNamedAboveTwoPerCent) {
  const auto of = [](std::size_t degraded) {
    return otherStates({stretch(10, TrackingState::kInitialising, 300, "standing still"),
                        stretch(20, TrackingState::kTracking, 900 - degraded, ""),
                        stretch(50, TrackingState::kDegraded, degraded, "coasting"),
                        stretch(60, TrackingState::kTracking, 100, "")});
  };
  EXPECT_EQ(of(20), "") << "two per cent; the start is no fault";
  EXPECT_EQ(
      of(21),
      "21 of 1000 images after the first pose are not TRACKING: DEGRADED 2.1 %; the longest stretch begins 40.0 s "
      "after the first image (DEGRADED: coasting)");
  EXPECT_EQ(otherStates({}), "");
  EXPECT_EQ(otherStates({stretch(10, TrackingState::kInitialising, 300, "standing still")}), "") << "no pose at all";
  EXPECT_EQ(otherStates({stretch(0, TrackingState::kTracking, 50, ""), stretch(2, TrackingState::kLost, 40, "dark"),
                         stretch(4, TrackingState::kDegraded, 10, "few features")}),
            "50 of 100 images after the first pose are not TRACKING: DEGRADED 10.0 %, LOST 40.0 %; the longest stretch "
            "begins 2.0 s after the first image (LOST: dark)");
}

}  // namespace
}  // namespace vip_slam
