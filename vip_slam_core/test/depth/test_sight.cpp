// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/depth/sight.h"

#include <memory>

#include <gtest/gtest.h>

namespace vip_slam {
namespace {

// Nodes every 10 px of a 100 x 80 image; a near surface left of u = 40, a far one right of it, nothing below v = 50.
class SightTest : public ::testing::Test {
 protected:
  SightTest() {
    CameraIntrinsics k;
    k.width = 100, k.height = 80, k.fx = k.fy = 100, k.cx = 50, k.cy = 40;
    camera = makeCamera(k);
    grid.stride = 10, grid.offset = 0, grid.cols = 10, grid.rows = 8;
    for (int r = 0; r < grid.rows; ++r) {
      for (int c = 0; c < grid.cols; ++c) grid.z.push_back(r > 5 ? 0.0f : c <= 4 ? 2.0f : 4.0f);
    }
  }
  Eigen::Vector3d at(double u, double v, double z) const { return camera->unproject({u, v}, z); }
  Sight sight(double u, double v, double z) const { return sightLine(grid, *camera, at(u, v, z)).at(z, 0.1); }

  std::shared_ptr<const CameraModel> camera;
  DepthGrid grid;
};

TEST_F(SightTest, TellsWhatIsBehindOnAndInFrontOfASurface) {
  EXPECT_EQ(Sight::kThrough, sight(15, 25, 1.8));
  EXPECT_EQ(Sight::kThere, sight(15, 25, 1.95));
  EXPECT_EQ(Sight::kThere, sight(15, 25, 2.05));
  EXPECT_EQ(Sight::kHidden, sight(15, 25, 2.2));
}

TEST_F(SightTest, BetweenTwoSurfacesAPlaceIsNeitherHiddenNorEmpty) {
  EXPECT_EQ(Sight::kThrough, sight(45, 25, 1.5));
  EXPECT_EQ(Sight::kThere, sight(45, 25, 3.0));
  EXPECT_EQ(Sight::kHidden, sight(45, 25, 4.5));
}

TEST_F(SightTest, CountsOnlyNodesWithDepth) {
  EXPECT_EQ(Sight::kNothing, sight(15, 65, 2.0));
  const SightLine border = sightLine(grid, *camera, at(15, 55, 2.0));
  EXPECT_EQ(2, border.measured);
  EXPECT_EQ(Sight::kThere, border.at(2.0, 0.1));
}

TEST_F(SightTest, SeesNothingOutsideTheImageOrBehindTheCamera) {
  EXPECT_EQ(Sight::kOutside, sight(120, 25, 2.0));
  EXPECT_EQ(Sight::kOutside, sight(95, 25, 2.0)) << "right of the last nodes";
  EXPECT_FALSE(sightLine(grid, *camera, {0, 0, -1}).inside);
  EXPECT_FALSE(sightLine(DepthGrid(), *camera, at(15, 25, 2)).inside);
}

}  // namespace
}  // namespace vip_slam
