// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_frontend/tracking/landmark_index.h"

namespace vip_slam {
namespace {

TEST(LandmarkIndex, FindsAllThatLiesAroundAfterChangesToo) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-60, 60);
  LandmarkIndex index(5.0);
  std::map<LandmarkId, Eigen::Vector3d> points;
  for (int k = 0; k < 4000; ++k) {
    const LandmarkId id = 1 + static_cast<LandmarkId>(k % 1500);  // most of them move
    points[id] = {u(random), u(random), u(random)};
    index.put(id, points[id]);
    if (k % 7 == 0) {
      index.remove(id);
      points.erase(id);
    }
  }
  index.put(7000, {1, std::numeric_limits<double>::quiet_NaN(), 0});
  for (const double radius : {0.0, 3.0, 22.0}) {
    const Eigen::Vector3d centre(u(random), u(random), 0);
    const std::vector<LandmarkId> found = index.around(centre, radius);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    EXPECT_EQ(found.end(), std::adjacent_find(found.begin(), found.end()));
    std::size_t within = 0;
    for (const auto& [id, p] : points) {
      const bool is_near = (p - centre).head<2>().norm() <= radius;
      within += is_near;
      if (is_near) EXPECT_TRUE(std::binary_search(found.begin(), found.end(), id)) << id;
    }
    for (const LandmarkId id : found) EXPECT_LT((points.at(id) - centre).head<2>().norm(), 1.5 * radius + 15) << id;
    EXPECT_GE(found.size(), within);
  }
  index.clear();
  EXPECT_TRUE(index.around(Eigen::Vector3d::Zero(), 100).empty());
}

}  // namespace
}  // namespace vip_slam
