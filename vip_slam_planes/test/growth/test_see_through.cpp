// SPDX-License-Identifier: BSD-3-Clause
// A keyframe's evidence against the cells of a plane.
#include <gtest/gtest.h>

#include "scene.h"
#include "vip_slam_planes/growth/see_through.h"

namespace vip_slam {
namespace {

constexpr int kOwn = 0, kOther = 1, kNone = -1;

class SeeThrough : public ::testing::Test {
 protected:
  // A wall of 2 x 2 m, three metres ahead; every node measures `depth` and shows `label`.
  int refuted(double depth, int label) {
    PlaneTrack track(1, PlaneKind::kVertical, Plane({-1, 0, 0}, 3), {3, 0, 0}, 0.1);
    for (int y = -10; y < 10; ++y)
      for (int x = -10; x < 10; ++x) track.coverCell({x, y}, 1, 1, view);
    cv::Mat image(camera.camera->height(), camera.camera->width(), CV_32FC1, cv::Scalar(depth));
    const DepthGrid grid = makeDepthGrid(image, 8, camera.noise);
    SurfaceLabels labels;
    labels.stride = grid.stride, labels.offset = grid.offset, labels.cols = grid.cols, labels.rows = grid.rows;
    labels.label.assign(grid.z.size(), label);
    const int count = clearRefuted(grid, labels, kOwn, *camera.camera, camera.noise, view, 0.1, &track);
    EXPECT_EQ(400 - count, track.cells().count(1));
    return count;
  }
  testing::SceneCamera camera;
  const SE3 view = testing::lookAt({0, 0, 0}, {3, 0, 0});
};

TEST_F(SeeThrough, DepthBehindSpeaksAgainstIt) {
  EXPECT_EQ(400, refuted(3.4, kNone));
  EXPECT_EQ(0, refuted(3.05, kNone));
  EXPECT_EQ(0, refuted(2.0, kNone));
}

TEST_F(SeeThrough, AnotherPlaneInItsPlaceSpeaksAgainstIt) {
  EXPECT_EQ(400, refuted(3.05, kOther));
  EXPECT_EQ(400, refuted(2.95, kOther));
  EXPECT_EQ(0, refuted(3.05, kOwn));
  EXPECT_EQ(0, refuted(2.0, kOther)) << "it is hidden behind the other one";
}

TEST_F(SeeThrough, OfALargeFloorWhatTheImageShows) {
  const SE3 tilted = testing::lookAt({0.3, -0.2, 1.5}, {2.5, 1, 0});
  PlaneTrack floor(1, PlaneKind::kHorizontal, Plane({0, 0, 1}, 0), {0, 0, 0}, 0.1);
  int expected = 0;
  for (int y = -150; y < 150; ++y) {
    for (int x = -150; x < 150; ++x) {
      floor.coverCell({x, y}, 1, 1, tilted);
      const Eigen::Vector3d p = tilted.inverse() * floor.cellCentre({x, y});
      Eigen::Vector2d uv;
      const bool facing = 1.5 > 0.25 * p.norm();
      // Between the outermost nodes of the grid, 4 px inside the image.
      expected += p.z() > 0.2 && facing && camera.camera->project(p, &uv) && (uv.array() >= 4).all() && uv.x() < 636 &&
                  uv.y() < 476;
    }
  }
  cv::Mat image(camera.camera->height(), camera.camera->width(), CV_32FC1, cv::Scalar(9.0));
  const DepthGrid grid = makeDepthGrid(image, 8, camera.noise);
  SurfaceLabels labels;
  labels.stride = grid.stride, labels.offset = grid.offset, labels.cols = grid.cols, labels.rows = grid.rows;
  labels.label.assign(grid.z.size(), kNone);
  EXPECT_GT(expected, 500);
  EXPECT_EQ(expected, clearRefuted(grid, labels, kOwn, *camera.camera, camera.noise, tilted, 0.1, &floor));
}

TEST_F(SeeThrough, APlaneThatLostMoreThanItHasIsGone) {
  PlaneTrack track(1, PlaneKind::kVertical, Plane({-1, 0, 0}, 3), {3, 0, 0}, 0.1);
  for (int x = 0; x < 20; ++x) track.coverCell({x, 0}, 1, 1, view);
  for (int x = 0; x < 10; ++x) track.miss({x, 0});
  EXPECT_FALSE(track.mostlyGone());
  track.miss({10, 0});
  EXPECT_TRUE(track.mostlyGone());
  for (int x = 0; x < 2; ++x) track.coverCell({x, 0}, 1, 1, view);  // seen again
  EXPECT_FALSE(track.mostlyGone());
}

}  // namespace
}  // namespace vip_slam
