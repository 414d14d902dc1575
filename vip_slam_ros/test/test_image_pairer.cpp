// Colour and depth meet by stamp, whatever order they arrive in.
#include <gtest/gtest.h>

#include "vip_slam_ros/image_pairer.h"

namespace vip_slam {
namespace {

cv::Mat image(int value) { return cv::Mat(1, 1, CV_32SC1, cv::Scalar(value)); }
int valueOf(const cv::Mat& m) { return m.empty() ? -1 : m.at<int>(0, 0); }

TEST(ImagePairer, SameStampsPairAtOnce) {
  ImagePairer pairer;
  pairer.addColor(1.0, image(1));
  EXPECT_EQ(pairer.front(), nullptr);
  pairer.addDepth(1.0, image(11));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 1);
  EXPECT_EQ(valueOf(pairer.front()->depth), 11);
  pairer.pop();
  EXPECT_EQ(pairer.front(), nullptr);
  EXPECT_EQ(pairer.counters().pairs, 1u);
}

TEST(ImagePairer, TheNearestDepthWins) {
  ImagePairer pairer;
  pairer.addDepth(0.990, image(10));
  pairer.addDepth(1.004, image(11));
  pairer.addColor(1.0, image(1));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->depth), 11);
  EXPECT_NEAR(pairer.counters().skew, 0.004, 1e-12);
  EXPECT_EQ(pairer.counters().unused_depth, 1u);
}

TEST(ImagePairer, AnEarlierDepthWaitsForABetterOne) {
  ImagePairer pairer;
  pairer.addColor(1.0, image(1));
  pairer.addDepth(0.99, image(10));
  EXPECT_EQ(pairer.front(), nullptr);  // 1.001 may still come
  pairer.addDepth(1.03, image(11));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->depth), 10);
}

TEST(ImagePairer, ColourGoesAloneWhenDepthStays) {
  PairerOptions options;
  options.patience = 0.1;
  ImagePairer pairer(options);
  pairer.addColor(1.00, image(1));
  pairer.addColor(1.05, image(2));
  EXPECT_EQ(pairer.front(), nullptr);
  pairer.addColor(1.11, image(3));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 1);
  EXPECT_TRUE(pairer.front()->depth.empty());
  pairer.pop();
  pairer.addDepth(1.11, image(13));
  pairer.addDepth(1.05, image(12));  // older than the last depth: refused
  EXPECT_EQ(pairer.counters().backward, 1u);
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 2);
  EXPECT_TRUE(pairer.front()->depth.empty());
  pairer.pop();
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->depth), 13);
  EXPECT_EQ(pairer.counters().without_depth, 2u);
}

TEST(ImagePairer, MemoryIsBounded) {
  PairerOptions options;
  options.capacity = 3;
  options.patience = 1e9;
  ImagePairer pairer(options);
  for (int i = 0; i < 10; ++i) pairer.addColor(i, image(i));
  EXPECT_EQ(pairer.counters().dropped, 7u);
  pairer.addDepth(7, image(70));
  ASSERT_NE(pairer.front(), nullptr);
  EXPECT_EQ(valueOf(pairer.front()->gray), 7);
}

TEST(ImagePairer, RepeatedAndInvalidStampsAreRefused) {
  ImagePairer pairer;
  EXPECT_TRUE(pairer.addColor(1, image(1)));
  EXPECT_FALSE(pairer.addColor(1, image(2)));
  EXPECT_FALSE(pairer.addColor(0.5, image(3)));
  EXPECT_FALSE(pairer.addColor(std::nan(""), image(4)));
  EXPECT_EQ(pairer.counters().backward, 3u);
  pairer.clear();
  EXPECT_TRUE(pairer.addColor(0.5, image(3)));
}

}  // namespace
}  // namespace vip_slam
