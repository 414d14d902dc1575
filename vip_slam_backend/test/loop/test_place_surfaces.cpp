// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>

#include "vip_slam_backend/loop/place_surfaces.h"
#include "vip_slam_backend/map/map_checker.h"

namespace vip_slam {
namespace {

// A wall five metres ahead and the floor, seen by a keyframe of the map and by a query next to it.
class PlaceSurfacesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    CameraIntrinsics k;
    k.width = 640;
    k.height = 480;
    k.fx = k.fy = 480;
    k.cx = 319.5;
    k.cy = 239.5;
    camera_ = makeCamera(k);
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = 1;
    keyframe->frame.depth_grid = see(T_W_V_);
    NavState state;
    state.T_W_I = T_W_V_;
    map_.addKeyframe(keyframe, state, ImuNoise());
    for (const PlaneId id : {1, 2}) {
      PlaneEstimate plane;
      plane.id = id;
      plane.plane = id == 1 ? wall_ : floor_;
      map_.setPlane(plane);
      PlaneObservation observation;
      observation.keyframe = 1;
      observation.plane = id;
      observation.points.push_back({Eigen::Vector3f(0, 0, 1), 0.01f});
      map_.setPlaneObservation(observation);
    }
    ASSERT_EQ(checkMap(map_), "");
  }
  DepthGrid see(const SE3& T_W_C) const {
    DepthGrid grid;
    grid.stride = 8;
    grid.offset = 4;
    grid.cols = 80;
    grid.rows = 60;
    for (int r = 0; r < grid.rows; ++r)
      for (int c = 0; c < grid.cols; ++c) {
        const Eigen::Vector3d ray = T_W_C.rotation() * camera_->unproject(grid.pixel(c, r), 1.0);
        double nearest = 100;
        for (const Plane& plane : {wall_, floor_}) {
          const double z = -plane.signedDistance(T_W_C.t()) / plane.n.dot(ray);
          if (z > 0) nearest = std::min(nearest, z);
        }
        grid.z.push_back(static_cast<float>(nearest));
      }
    return grid;
  }

  const Plane wall_{Eigen::Vector3d(-1, 0, 0), 5.0}, floor_{Eigen::Vector3d(0, 0, 1), 0.0};
  const Eigen::Quaterniond ahead_{0.5, -0.5, 0.5, -0.5};  // z along x
  const SE3 T_W_V_{ahead_, Eigen::Vector3d(0, 0, 1.5)};
  std::shared_ptr<const CameraModel> camera_;
  Map map_;
};

TEST_F(PlaceSurfacesTest, EachPointGetsThePlaneItLiesOn) {
  const SE3 truth(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ())) * ahead_, {0.3, 0.4, 1.4});
  const SE3 guess = truth.boxplus((Vector6d() << 0.004, -0.006, 0.003, 0.02, -0.02, 0.01).finished());
  const auto surfaces = matchSurfaces(map_, 1, see(truth), guess, *camera_, 3);
  std::map<bool, double> weight;  // of the wall, of the floor
  std::size_t other = 0;
  for (const PlaceSurface& s : surfaces) {
    EXPECT_EQ(s.camera, 3u);
    // Nearer to the edge than the error of the guess, a point may be assigned to either surface.
    const double off = std::abs(s.plane_W.signedDistance(truth * s.p_C));
    EXPECT_LT(off, 0.05);
    other += off > 0.001;
    weight[s.plane_W.n.z() > 0.5] += 1.0 / (s.sigma * s.sigma);
  }
  EXPECT_GT(surfaces.size(), 200u);
  EXPECT_LT(other, surfaces.size() / 50);
  ASSERT_EQ(weight.size(), 2u);
  // The wall fills more of the image than the floor but gets no more weight.
  EXPECT_NEAR(weight[true], weight[false], 1e-6 * weight[true]);
}

TEST_F(PlaceSurfacesTest, SurfacesThatTheMapDoesNotHaveThereAreLeftAlone) {
  DepthGrid moved = see(T_W_V_);
  for (float& z : moved.z) z -= 0.4f;  // a cupboard in front of the wall
  EXPECT_TRUE(matchSurfaces(map_, 1, moved, T_W_V_, *camera_, 0).empty());
  EXPECT_TRUE(matchSurfaces(map_, 1, DepthGrid(), T_W_V_, *camera_, 0).empty());
  map_.removePlane(1);
  for (const PlaceSurface& s : matchSurfaces(map_, 1, see(T_W_V_), T_W_V_, *camera_, 0))
    EXPECT_GT(s.plane_W.n.z(), 0.5);
}

}  // namespace
}  // namespace vip_slam
