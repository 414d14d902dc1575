// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "vip_slam_ros/stream_monitor.h"

namespace vip_slam {
namespace {

using Step = StreamMonitor::Step;

TEST(StreamMonitor, MeasuresTheRate) {
  StreamMonitor monitor("/imu", 200);
  for (int i = 0; i < 500; ++i) EXPECT_EQ(monitor.add(10 + i / 200.0, 10.01 + i / 200.0), Step::kGood);
  EXPECT_NEAR(monitor.report().rate, 200, 1e-6);
  EXPECT_NEAR(monitor.report().delay, 0.01, 1e-9);
  EXPECT_EQ(monitor.complaint(12.6), "");
}

TEST(StreamMonitor, CountsWhatIsWrong) {
  StreamMonitor monitor("/depth", 30);
  EXPECT_EQ(monitor.add(1.0, 1.0), Step::kGood);
  EXPECT_EQ(monitor.add(1.0, 1.0), Step::kRepeated);
  EXPECT_EQ(monitor.add(0.9, 1.1), Step::kBackward);
  EXPECT_EQ(monitor.add(1.5, 1.5), Step::kGap);
  const auto report = monitor.report();
  EXPECT_EQ(report.messages, 4u);
  EXPECT_EQ(report.repeated, 1u);
  EXPECT_EQ(report.backward, 1u);
  EXPECT_EQ(report.gaps, 1u);
  EXPECT_NEAR(report.largest_gap, 0.5, 1e-9);
}

TEST(StreamMonitor, OneStampFarAheadSilencesNothing) {
  StreamMonitor monitor("/imu", 200);
  for (int i = 0; i < 200; ++i) monitor.add(10 + i / 200.0, 10 + i / 200.0);
  monitor.add(3611, 11);
  for (int i = 1; i < 200; ++i) monitor.add(11 + i / 200.0, 11 + i / 200.0);
  EXPECT_EQ(monitor.report().backward, 2u);
  EXPECT_NEAR(monitor.report().rate, 200, 1e-6);
  EXPECT_EQ(monitor.complaint(12), "");
}

TEST(StreamMonitor, ComplaintsNameTheTopic) {
  StreamMonitor monitor("/camera/imu", 200);
  EXPECT_NE(monitor.complaint(1).find("/camera/imu"), std::string::npos);
  EXPECT_EQ(monitor.silence(100), "");  // the stream has not started
  for (int i = 0; i < 50; ++i) monitor.add(i / 20.0, i / 20.0);
  EXPECT_NE(monitor.complaint(2.5).find("20.0 Hz"), std::string::npos) << monitor.complaint(2.5);
  EXPECT_NE(monitor.complaint(10).find("silent"), std::string::npos);
  EXPECT_EQ(monitor.silence(2.5), "");
  EXPECT_NE(monitor.silence(10).find("/camera/imu: silent for 7.5"), std::string::npos) << monitor.silence(10);
}

TEST(StreamMonitor, NamesAStreamThatBringsNothingUsableAnyMore) {
  StreamMonitor monitor("/color", 30);
  double t = 0;
  const auto message = [&](bool usable) {
    monitor.add(t, t);
    if (!usable) monitor.reject("image encoding 'h264', expected mono8");
    t += 1.0 / 30;
  };
  for (int i = 0; i < 300; ++i) message(i % 10 != 3);  // now and then a damaged one
  EXPECT_EQ(monitor.complaint(t), "");
  for (int i = 0; i < 10; ++i) message(false);
  EXPECT_NE(monitor.complaint(t).find("h264"), std::string::npos) << monitor.complaint(t);
  EXPECT_EQ(monitor.silence(t), monitor.complaint(t));
  message(true);
  message(true);
  EXPECT_EQ(monitor.complaint(t), "");
}

TEST(StreamMonitor, NamesADriverThatDoesNotStampItsMessages) {
  StreamMonitor monitor("/imu", 200);
  for (int i = 0; i < 200; ++i) monitor.add(0, 50 + i / 200.0);
  EXPECT_NE(monitor.complaint(51).find("/imu: all stamps are the same"), std::string::npos) << monitor.complaint(51);
}

TEST(StreamMonitor, StartsAnewAfterTimeRanBackwards) {
  StreamMonitor monitor("/color", 30);
  monitor.add(100, 100);
  monitor.restart();
  EXPECT_EQ(monitor.add(5, 5), Step::kGood);
}

TEST(StreamMonitor, AnotherRateIsOddButNoFault) {
  StreamMonitor monitor("/camera/color", 30);
  for (int k = 0; k < 60; ++k) monitor.add(0.05 * k, 0.05 * k);
  EXPECT_EQ(monitor.fault(3.0), "");
  EXPECT_NE(monitor.complaint(3.0).find("20.0 Hz"), std::string::npos);
}

TEST(StreamMonitor, NamesWhoElsePublishes) {
  StreamMonitor monitor("/color", 30);
  for (int i = 0; i < 60; ++i) {
    ASSERT_TRUE(monitor.admits("front", i / 30.0));
    monitor.add(i / 30.0, i / 30.0);
    if (i >= 30) {
      ASSERT_FALSE(monitor.admits("back", i / 30.0 + 0.01));
    }
  }
  EXPECT_NEAR(monitor.report().rate, 30, 1e-6);  // of the one camera
  EXPECT_EQ(monitor.report().messages, 60u);
  EXPECT_EQ(monitor.report().of_other_frame, 30u);
  EXPECT_NE(monitor.complaint(2).find("topic /color: 30 of 90 messages have frame_id 'back'"), std::string::npos)
      << monitor.complaint(2);
  EXPECT_EQ(monitor.silence(2), "");  // images come
  EXPECT_EQ(monitor.fault(2), "");
  for (int i = 60; i < 150; ++i) monitor.admits("back", i / 30.0);
  EXPECT_NE(monitor.silence(5).find("silent for 3.0 s; 120 of 180 messages"), std::string::npos) << monitor.silence(5);
  for (int i = 150; i < 300; ++i) {
    ASSERT_TRUE(monitor.admits("front", i / 30.0));
    monitor.add(i / 30.0, i / 30.0);
  }
  EXPECT_EQ(monitor.complaint(10), "");  // the other one has ended
  monitor.setPublishers({"/camera", "/player"});
  EXPECT_NE(monitor.complaint(10).find("published by 2 nodes: /camera, /player"), std::string::npos);
  monitor.setPublishers({"/camera"});
  EXPECT_EQ(monitor.complaint(10), "");
}

}  // namespace
}  // namespace vip_slam
