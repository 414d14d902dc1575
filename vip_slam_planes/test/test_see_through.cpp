// What a keyframe says against the cells of a plane.
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

}  // namespace
}  // namespace vip_slam
