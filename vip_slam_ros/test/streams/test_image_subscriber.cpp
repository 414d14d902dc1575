// SPDX-License-Identifier: BSD-3-Clause
// Which topic a camera's images are read from, and by what.
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "vip_slam_ros/image_subscriber.h"

namespace vip_slam {
namespace {

const std::vector<std::string> kDebian = {"raw"}, kAll = {"compressed", "compressedDepth", "raw", "theora"};

/// "topic by plugin" or "topic decoded here".
std::string words(const ImageSource& source) {
  return source.topic + (source.plugin ? " by " + source.transport : " decoded here");
}

TEST(ImageTransport, TheSensorFileAloneDecides) {
  EXPECT_EQ(words(chooseTransport("/c/image_raw", "rgb8", "", false, kDebian)), "/c/image_raw by raw");
  EXPECT_EQ(words(chooseTransport("/c/image_raw/compressed", "compressed", "", false, kDebian)),
            "/c/image_raw/compressed decoded here");
  EXPECT_EQ(words(chooseTransport("/d/compressedDepth", "compressed", "", true, kDebian)),
            "/d/compressedDepth decoded here");
  // Names that image_transport would not look for; raw images under a name that looks like a transport's.
  for (const auto& installed : {kDebian, kAll}) {
    EXPECT_EQ(words(chooseTransport("/c/jpeg", "compressed", "", false, installed)), "/c/jpeg decoded here");
    EXPECT_EQ(words(chooseTransport("/compressed", "compressed", "", false, installed)), "/compressed decoded here");
    EXPECT_EQ(words(chooseTransport("/c/compressed", "bgr8", "", false, installed)), "/c/compressed by raw");
  }
}

TEST(ImageTransport, APluginIsUsedWhereItIsInstalled) {
  const ImageSource source = chooseTransport("/c/image_raw/compressed", "compressed", "", false, kAll);
  EXPECT_EQ(words(source), "/c/image_raw/compressed by compressed");
  EXPECT_EQ(source.base, "/c/image_raw");
  EXPECT_EQ(words(chooseTransport("/d/raw/compressedDepth", "compressed", "", true, kAll)),
            "/d/raw/compressedDepth by compressedDepth");
  // The plugin for pictures would take a 16-bit PNG for 8 bit.
  EXPECT_EQ(words(chooseTransport("/d/raw/compressed", "compressed", "", true, kAll)),
            "/d/raw/compressed decoded here");
}

TEST(ImageTransport, TheUserChoosesAnother) {
  EXPECT_EQ(words(chooseTransport("/c/image_raw", "rgb8", "compressed", false, kDebian)),
            "/c/image_raw/compressed decoded here");
  EXPECT_EQ(words(chooseTransport("/d/image_raw", "16UC1", "compressedDepth", true, kDebian)),
            "/d/image_raw/compressedDepth decoded here");
  EXPECT_EQ(words(chooseTransport("/c/image_raw/compressed", "compressed", "raw", false, kDebian)),
            "/c/image_raw by raw");
  EXPECT_EQ(words(chooseTransport("/c/image_raw", "rgb8", "theora", false, kAll)), "/c/image_raw/theora by theora");
}

TEST(ImageTransport, OneThatIsNotInstalledIsNamed) {
  try {
    chooseTransport("/c/image_raw", "rgb8", "theora", false, kDebian);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(
        error.what(),
        "image transport 'theora' of /c/image_raw: not installed; there are: compressed, compressedDepth, raw");
  }
}

TEST(ImageTransport, TypesAreThoseOfTheMessages) {
  EXPECT_EQ(chooseTransport("/c", "rgb8", "", false, kDebian).type(), "sensor_msgs/Image");
  EXPECT_EQ(chooseTransport("/c", "rgb8", "compressed", false, kAll).type(), "sensor_msgs/CompressedImage");
  EXPECT_EQ(chooseTransport("/c", "rgb8", "theora", false, kAll).type(), "");
}

}  // namespace
}  // namespace vip_slam
