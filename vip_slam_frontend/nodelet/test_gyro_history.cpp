// The rate belongs to the time that was asked for, not to the newest sample.
#include <cmath>

#include <gtest/gtest.h>

#include "gyro_history.h"

namespace vip_slam {
namespace {

TEST(GyroHistory, TheRateIsThatOfTheTime) {
  GyroHistory history;
  EXPECT_EQ(history.at(1), Eigen::Vector3d::Zero());
  for (int i = 0; i <= 10; ++i) history.add(0.01 * i, {double(i), 0, 0});
  EXPECT_NEAR(history.at(0.03).x(), 3, 1e-9);
  EXPECT_NEAR(history.at(0.045).x(), 4.5, 1e-9);
  EXPECT_EQ(history.at(-1).x(), 0);
  EXPECT_EQ(history.at(1).x(), 10);
}

TEST(GyroHistory, BadSamplesAreLeftOutAndOldOnesForgotten) {
  GyroHistory history;
  history.add(1, {1, 0, 0});
  history.add(1, {2, 0, 0});
  history.add(0.5, {3, 0, 0});
  history.add(std::nan(""), {4, 0, 0});
  history.add(2, {std::nan(""), 0, 0});
  EXPECT_EQ(history.at(5).x(), 1);
  history.add(100, {7, 0, 0});
  EXPECT_EQ(history.at(1).x(), 7);
  history.clear();
  history.add(0.5, {3, 0, 0});
  EXPECT_EQ(history.at(0).x(), 3);
}

}  // namespace
}  // namespace vip_slam
