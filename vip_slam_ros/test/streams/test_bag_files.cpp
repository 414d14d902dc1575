// SPDX-License-Identifier: BSD-3-Clause
// Recordings in several bags.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sensor_msgs/Imu.h>

#include "vip_slam_ros/bag_files.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

class BagFilesTest : public testing::Test {
 protected:
  BagFilesTest() { fs::create_directories(folder_); }
  ~BagFilesTest() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  /// Messages at whole seconds from `begin` to `end`.
  std::string write(const std::string& name, int begin, int end, const std::string& topic = "/imu") const {
    rosbag::Bag bag(path(name), rosbag::bagmode::Write);
    for (int t = begin; t <= end; ++t) {
      sensor_msgs::Imu imu;
      imu.header.stamp = ros::Time(t, 0);
      bag.write(topic, imu.header.stamp, imu);
    }
    return path(name);
  }
  static std::vector<int> stampsOf(const BagSet& bags, const std::vector<std::string>& topics = {}) {
    std::vector<int> stamps;
    const auto view = bags.view(topics);
    for (const auto& message : *view) stamps.push_back(static_cast<int>(message.getTime().sec));
    return stamps;
  }
  static std::string whyNot(const std::vector<std::string>& inputs) {
    try {
      BagSet bags(inputs);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  const fs::path folder_ = fs::temp_directory_path() / ("vip_slam_bag_files_" + std::to_string(::getpid()));
};

TEST_F(BagFilesTest, BagsAreReadInOrderOfTimeWhateverTheirOrder) {
  const std::string late = write("a.bag", 20, 22), early = write("b.bag", 10, 12), middle = write("c.bag", 13, 15);
  const BagSet bags({late, early, middle, early});
  EXPECT_EQ(bags.size(), 3u) << "a bag given twice is read once";
  EXPECT_EQ(stampsOf(bags), (std::vector<int>{10, 11, 12, 13, 14, 15, 20, 21, 22}));
  EXPECT_EQ(bags.name(), early + " and 2 more");
  EXPECT_EQ(bags.paths(), early + ", " + middle + ", " + late);
  EXPECT_EQ(
      bags.description(),
      "3 bags in order of time: b.bag (2.0 s), c.bag (2.0 s), a.bag (2.0 s, 5.0 s after the end of those before)");
}

TEST_F(BagFilesTest, BagsSplitByTopicsAreMerged) {
  const std::string imu = write("imu.bag", 10, 13), camera = write("camera.bag", 11, 12, "/camera");
  const BagSet bags({imu, camera});
  EXPECT_EQ(stampsOf(bags), (std::vector<int>{10, 11, 11, 12, 12, 13}));
  EXPECT_EQ(stampsOf(bags, {"/camera"}), (std::vector<int>{11, 12}));
  const auto part = bags.view({"/imu"}, ros::Time(11, 0), ros::Time(12, 0));
  EXPECT_EQ(part->size(), 2u);
}

TEST_F(BagFilesTest, FoldersAndPatternsStandForTheirBags) {
  write("run_0.bag", 10, 12), write("run_1.bag", 13, 15), write("other.bag", 30, 31), write("run_0.orig.bag", 10, 12);
  std::ofstream(path("notes.txt")) << "not a bag\n";
  EXPECT_EQ(stampsOf(BagSet({path("run_*.bag")})), (std::vector<int>{10, 11, 12, 13, 14, 15}));
  EXPECT_EQ(stampsOf(BagSet({folder_.string()})), (std::vector<int>{10, 11, 12, 13, 14, 15, 30, 31}));
  EXPECT_EQ(stampsOf(BagSet({path("run_0.orig.bag")})), (std::vector<int>{10, 11, 12})) << "by its own name";
}

TEST_F(BagFilesTest, WhatIsNoRecordingIsNamed) {
  EXPECT_EQ(whyNot({path("x.bag")}), path("x.bag") + ": no such file, expected a bag");
  EXPECT_EQ(whyNot({path("x*.bag")}), path("x*.bag") + ": no file matches, expected bags");
  EXPECT_EQ(whyNot({folder_.string()}), folder_.string() + ": no bag (*.bag) in this folder");
  const std::string empty = write("empty.bag", 1, 0);
  EXPECT_EQ(whyNot({empty}), empty + ": an empty bag");
  std::ofstream(path("x.bag")) << "text\n";
  EXPECT_NE(whyNot({empty, path("x.bag")}).find("x.bag: not a readable bag"), std::string::npos);
  const BagSet bags({empty, write("full.bag", 5, 6)});
  EXPECT_EQ(bags.description(), "2 bags in order of time: empty.bag (empty), full.bag (1.0 s)");
}

}  // namespace
}  // namespace vip_slam
