// SPDX-License-Identifier: BSD-3-Clause
// The files that export_map writes of a map's points, read by PCL.
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "map_io/synthetic_map.h"
#include "vip_slam_backend/export/point_files.h"

namespace vip_slam {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZL>;

class PointFiles : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string stem() const { return folder_ + "/points"; }
  /// The PLY file; the PCD file has the same in it.
  Cloud readBoth() const {
    Cloud ply, pcd;
    EXPECT_EQ(pcl::io::loadPLYFile(stem() + ".ply", ply), 0);
    EXPECT_EQ(pcl::io::loadPCDFile(stem() + ".pcd", pcd), 0);
    EXPECT_EQ(ply.size(), pcd.size());
    for (std::size_t i = 0; i < std::min(ply.size(), pcd.size()); ++i) {
      EXPECT_NEAR((ply[i].getVector3fMap() - pcd[i].getVector3fMap()).norm(), 0, 1e-5);
      EXPECT_EQ(ply[i].label, pcd[i].label);
    }
    return ply;
  }

  const std::string folder_ = "/tmp/vip_slam_points_" + std::to_string(::getpid());
};

TEST_F(PointFiles, HaveEveryPointWithItsPlane) {
  const Map map = syntheticMap(4, 30, 100);
  EXPECT_EQ(writePoints(stem(), map), map.landmarks().size());
  const Cloud cloud = readBoth();
  ASSERT_EQ(cloud.size(), map.landmarks().size());
  std::size_t i = 0, on_planes = 0;
  for (const LandmarkId id : map.landmarkIds()) {
    EXPECT_NEAR((cloud[i].getVector3fMap().cast<double>() - map.landmark(id).p_W).norm(), 0, 1e-5);
    EXPECT_EQ(cloud[i].label, map.landmark(id).plane);
    on_planes += cloud[i++].label != 0;
  }
  EXPECT_GT(on_planes, 0u);
  EXPECT_LT(on_planes, cloud.size());
}

TEST_F(PointFiles, OnePointInACube) {
  const Map map = syntheticMap(4, 30, 100);
  const std::size_t written = writePoints(stem(), map, {0, 0.5});
  EXPECT_LT(written, map.landmarks().size());
  const Cloud cloud = readBoth();
  ASSERT_EQ(cloud.size(), written);
  std::set<std::array<long, 3>> cubes;
  for (const auto& p : cloud)
    cubes.insert({std::lround(std::floor(p.x / 0.5f)), std::lround(std::floor(p.y / 0.5f)),
                  std::lround(std::floor(p.z / 0.5f))});
  EXPECT_EQ(cubes.size(), written);
}

TEST_F(PointFiles, APointFarFromAllOthersIsLeftOut) {
  Map map = syntheticMap(4, 30, 100);
  const LandmarkId far = *map.landmarkIds().begin();
  map.landmark(far).p_W = {0, 0, 500};
  EXPECT_EQ(writePoints(stem(), map, {3, 0}), map.landmarks().size() - 1);
  for (const auto& p : readBoth()) EXPECT_LT(p.z, 400);
}

TEST_F(PointFiles, WhatCannotBeDoneIsNamed) {
  const Map map = syntheticMap(4, 30, 100);
  try {
    writePoints(stem(), map, {0, 1e-4});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).find("voxel: 0.0001 m, too small for a map of "), 0u) << error.what();
  }
  EXPECT_THROW(writePoints("/nonexistent/points", map), std::runtime_error);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(PointFiles, AMapWithoutPointsGivesNoFiles) {
  EXPECT_EQ(writePoints(stem(), Map(), {3, 0.1}), 0u);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace vip_slam
