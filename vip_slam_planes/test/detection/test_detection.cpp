// SPDX-License-Identifier: BSD-3-Clause
// Mesh and detection on exact scenes: one keyframe, no map.
#include <gtest/gtest.h>

#include "scene.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_planes/detection/plane_detector.h"
#include "vip_slam_planes/detection/plane_histogram.h"
#include "vip_slam_planes/detection/surface_shape.h"
#include "vip_slam_planes/mesh/map_triangles.h"

namespace vip_slam {
namespace {

using testing::lookAt;
using testing::Scene;
using testing::SceneCamera;

std::vector<DetectedPlane> detect(SceneCamera* camera, const Scene& scene, const SE3& T_W_C,
                                  PlaneDetectionOptions options = {}) {
  const auto keyframe = camera->keyframe(scene, T_W_C);
  DepthMeshBuilder builder({}, camera->camera, camera->noise);
  const TrackedFrame& frame = keyframe->frame;
  const auto triangles = placeMesh(builder.build(frame.features, frame.depth_grid, T_W_C.R().row(2)), T_W_C);
  return detectPlanes(triangles, std::vector<char>(triangles.size(), 0), T_W_C.t(), options, {});
}

const DetectedPlane* find(const std::vector<DetectedPlane>& planes, const Plane& truth) {
  for (const DetectedPlane& p : planes) {
    if (p.plane.n.dot(truth.n) > 0.999 && std::abs(p.plane.d - truth.d) < 0.02) return &p;
  }
  return nullptr;
}

TEST(Detection, RoomCorner) {
  Scene scene;
  scene.addRoom({-3, -3, 0}, {3, 3, 2.6});
  SceneCamera camera;
  const auto planes = detect(&camera, scene, lookAt({0, 0, 1.4}, {3, 3, 0.9}));
  ASSERT_EQ(3u, planes.size());
  for (const Plane& truth : {Plane({0, 0, 1}, 0), Plane({-1, 0, 0}, 3), Plane({0, -1, 0}, 3)}) {
    const DetectedPlane* p = find(planes, truth);
    ASSERT_TRUE(p);
    EXPECT_LT(angleBetween(p->plane, truth), 0.05 * kDegree);
    EXPECT_NEAR(truth.d, p->plane.d, 0.002);
    EXPECT_GT(p->area, 1.0);
  }
}

TEST(Detection, PlanesThroughTheOrigin) {
  Scene scene;
  scene.add({0, -3, -1}, {0, 6, 0}, {0, 0, 3});  // x = 0
  scene.add({-3, 0, -1}, {6, 0, 0}, {0, 0, 3});  // y = 0
  scene.add({-3, -3, 0}, {6, 0, 0}, {0, 6, 0});  // z = 0
  SceneCamera camera(testing::quietNoise(), 1.0);
  const auto planes = detect(&camera, scene, lookAt({2, 2, 1.2}, {0, 0, 0.3}));
  ASSERT_EQ(3u, planes.size());
  for (const Plane& truth : {Plane({1, 0, 0}, 0), Plane({0, 1, 0}, 0), Plane({0, 0, 1}, 0)}) {
    const DetectedPlane* p = find(planes, truth);
    ASSERT_TRUE(p);
    EXPECT_NEAR(0, p->plane.d, 0.004);
  }
}

TEST(Detection, DoorTwelveCentimetresBeforeTheWallStaysTwo) {
  Scene scene;
  scene.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
  scene.add({2.88, -0.5, 0}, {0, 1, 0}, {0, 0, 2.1});
  SceneCamera camera(testing::quietNoise(), 1.0);
  const auto planes = detect(&camera, scene, lookAt({0, 0.2, 1.4}, {3, 0, 1.3}));
  ASSERT_EQ(2u, planes.size());
  ASSERT_TRUE(find(planes, Plane({-1, 0, 0}, 3.0)));
  ASSERT_TRUE(find(planes, Plane({-1, 0, 0}, 2.88)));
  EXPECT_NEAR(3.0, find(planes, Plane({-1, 0, 0}, 3.0))->plane.d, 0.004);
  EXPECT_NEAR(2.88, find(planes, Plane({-1, 0, 0}, 2.88))->plane.d, 0.004);
}

TEST(Detection, WallsAtEveryAngleIncludingTheWrap) {
  for (double degrees : {180.0, 179.2, -179.2, 178.5, -178.5, 90.0, -90.0, 0.0, 45.0, -1.5}) {
    const double a = degrees * kDegree;
    const Eigen::Vector3d n(std::cos(a), std::sin(a), 0), along(-n.y(), n.x(), 0);
    Scene scene;
    scene.add(-2.0 * n - 3 * along, 6 * along, {0, 0, 2.5});
    SceneCamera camera(testing::quietNoise(), 1.0);
    const auto planes = detect(&camera, scene, lookAt({0.3, 0.2, 1.2}, -2 * n + Eigen::Vector3d(0, 0, 1.3)));
    ASSERT_EQ(1u, planes.size()) << degrees;
    EXPECT_TRUE(find(planes, Plane(n, 2.0))) << degrees;
  }
}

TEST(Detection, SlantedSurfacesAreLeftAloneUnlessAskedFor) {
  for (double degrees : {6.0, 12.0, 30.0, 60.0, 80.0}) {
    const double a = degrees * kDegree;
    Scene scene;
    scene.add({1, -1.5, 0.2}, {0, 3, 0}, Eigen::Vector3d(std::cos(a), 0, std::sin(a)) * 2.0);
    SceneCamera camera(testing::quietNoise(), 1.0);
    const SE3 view = lookAt({-0.5, 0, 2.2}, {1.8, 0, 0.6});
    EXPECT_TRUE(detect(&camera, scene, view).empty()) << degrees;
    PlaneDetectionOptions options;
    options.general = true;
    const auto planes = detect(&camera, scene, view, options);
    ASSERT_EQ(1u, planes.size()) << degrees;
    EXPECT_EQ(PlaneKind::kGeneral, planes[0].kind);
    EXPECT_NEAR(degrees, std::acos(std::abs(planes[0].plane.n.z())) / kDegree, 0.5);
  }
}

TEST(Detection, StairsAreNoPlaneButTheirTreads) {
  Scene scene;
  for (int i = 0; i < 6; ++i) {
    scene.add({1 + 0.3 * i, -1, 0.17 * i}, {0, 2, 0}, {0, 0, 0.17});
    scene.add({1 + 0.3 * i, -1, 0.17 * (i + 1)}, {0, 2, 0}, {0.3, 0, 0});
  }
  SceneCamera camera(testing::quietNoise(), 1.0);
  for (const DetectedPlane& p : detect(&camera, scene, lookAt({-0.6, 0, 1.9}, {2, 0, 0.5}))) {
    const double height = -p.plane.d * p.plane.n.z();
    if (p.kind == PlaneKind::kHorizontal) {
      EXPECT_NEAR(0, std::remainder(height, 0.17), 0.01);
    } else {
      EXPECT_NEAR(0, std::remainder(-p.plane.d / p.plane.n.x() - 1, 0.3), 0.01);
    }
    EXPECT_LT(p.area, 0.8);
  }
}

TEST(Detection, ARoundColumnIsNoPlane) {
  for (double radius : {0.28, 0.5}) {
    Scene scene;
    for (int i = 0; i < 64; ++i) {
      const double a = 2 * M_PI * i / 64, b = 2 * M_PI * (i + 1) / 64;
      const Eigen::Vector3d p(radius * std::cos(a), radius * std::sin(a), 0);
      const Eigen::Vector3d q(radius * std::cos(b), radius * std::sin(b), 0);
      scene.add(p, q - p, {0, 0, 4});
    }
    SceneCamera camera(testing::quietNoise(), 1.0);
    for (double distance : {1.5, 2.5, 3.5}) {
      for (double a : {0.0, 0.7, 2.0}) {
        const Eigen::Vector3d eye(distance * std::cos(a), distance * std::sin(a), 1.6);
        EXPECT_TRUE(detect(&camera, scene, lookAt(eye, {0, 0, 1.7})).empty()) << radius << " m from " << distance;
      }
    }
  }
}

TEST(Detection, WallAndDoorOfARecessAreNotOneSlantedPlane) {
  // A structured-light sensor across a room: the door is set back by a few sigmas of a single depth reading.
  DepthNoise noise;
  noise.a = 0.001, noise.b = 0, noise.c = 0.001425, noise.min_range = 0.3, noise.max_range = 10;
  Scene scene;
  scene.add({4.5, 2.85, 0}, {0, 0.65, 0}, {0, 0, 2.1});
  scene.add({4.62, 1.9, 0}, {0, 0.95, 0}, {0, 0, 2.1});
  for (double x : {0.0, 1.5}) {
    int planes = 0;
    for (unsigned seed = 1; seed <= 5; ++seed) {
      SceneCamera camera(noise, 1.0, seed);
      for (const DetectedPlane& p : detect(&camera, scene, lookAt({x, 2.9, 1.4}, {4.5, 2.9, 1.2}))) {
        EXPECT_LT(std::acos(-p.plane.n.x()) / kDegree, 2.5) << seed << ": " << p.area << " m^2";
        ++planes;
      }
    }
    EXPECT_GE(planes, 5) << x;
  }
}

TEST(Detection, AStepThatNoiseHidesMayLookLikeASurface) {
  // A surface that starts 5 m ahead and extends by `depth` along the viewing direction and by `across` sideways.
  const auto seen = [](double depth, double across, double depth_sigma) {
    const Plane plane = Plane::fromPointNormal({5, 0, 0}, Eigen::Vector3d(-across, depth, 0).normalized());
    const double facing = -plane.n.dot(Eigen::Vector3d::UnitX());
    std::vector<MapTriangle> triangles(40);
    std::vector<int> all;
    for (int i = 0; i < 40; ++i) {
      const double s = double(i) / 39;
      triangles[i].centre = Eigen::Vector3d(5 + s * depth, s * across, 0.05 * (i % 7));
      triangles[i].sigma = depth_sigma * facing;
      all.push_back(i);
    }
    return mayBeAStep(triangles, all, plane, Eigen::Vector3d::Zero());
  };
  EXPECT_TRUE(seen(0.5, 0.2, 0.05));    // half a metre is hidden by 5 cm of noise
  EXPECT_FALSE(seen(0.5, 0.2, 0.005));  // but not by 5 mm: a pillar's side
  EXPECT_FALSE(seen(3.0, 1.0, 0.05));   // a continuous wall
  EXPECT_FALSE(seen(0.1, 0.8, 0.05));   // a wall seen from the front
}

TEST(Detection, TwoTablesOfOneHeightAreTwo) {
  Scene scene;
  scene.add({1.2, -1.6, 0.74}, {0.8, 0, 0}, {0, 1.2, 0});
  scene.add({1.2, 0.4, 0.74}, {0.8, 0, 0}, {0, 1.2, 0});
  SceneCamera camera;
  const auto planes = detect(&camera, scene, lookAt({-0.5, 0, 1.9}, {1.6, 0, 0.74}));
  ASSERT_EQ(2u, planes.size());
  for (const DetectedPlane& p : planes) EXPECT_NEAR(-0.74, p.plane.d, 0.002);
}

TEST(Detection, ATrayOnAShelfLiesAboveIt) {
  Scene scene;
  scene.add({1.2, -0.5, 0.9}, {0.6, 0, 0}, {0, 1.0, 0});
  scene.add({1.3, -0.4, 0.95}, {0.4, 0, 0}, {0, 0.7, 0});
  SceneCamera camera(testing::quietNoise(), 1.0);
  const auto planes = detect(&camera, scene, lookAt({0, 0.2, 1.6}, {1.5, 0, 0.9}));
  ASSERT_EQ(2u, planes.size());
  const auto [low, high] = std::minmax(planes[0].plane.d, planes[1].plane.d);
  EXPECT_NEAR(-0.95, low, 0.003);
  EXPECT_NEAR(-0.90, high, 0.003);
}

TEST(Detection, DeskAcrossTheRoomIsFoundAtAFlatAngle) {
  Scene scene;
  scene.addRoom({-1, -3, 0}, {7, 3, 4});
  scene.add({4.5, -0.8, 0.74}, {0.8, 0, 0}, {0, 1.6, 0});
  SceneCamera camera(testing::quietNoise(), 1.0);
  for (double x : {1.2, 1.9}) {  // two or three nodes high in the image
    EXPECT_TRUE(find(detect(&camera, scene, lookAt({x, 0.5, 1.5}, {4, 0, 1.2})), Plane({0, 0, 1}, -0.74))) << x;
  }
}

TEST(Detection, MeshDropsTrianglesAcrossDepthEdges) {
  Scene scene;
  scene.add({4, -4, -2}, {0, 8, 0}, {0, 0, 6});
  scene.add({3, -0.5, 0}, {0, 1, 0}, {0, 0, 1.5});
  SceneCamera camera;
  const SE3 view = lookAt({0, 0, 1}, {4, 0, 1});
  const auto keyframe = camera.keyframe(scene, view);
  DepthMeshBuilder builder({}, camera.camera, camera.noise);
  const auto triangles = placeMesh(builder.build({}, keyframe->frame.depth_grid, view.R().row(2)), view);
  ASSERT_GT(triangles.size(), 1000u);
  for (const MapTriangle& t : triangles) EXPECT_GT(-t.n.x(), 0.98);
}

TEST(Detection, ASmallImageMakesAsFineAMesh) {
  Scene scene;
  scene.add({4, -4, -2}, {0, 8, 0}, {0, 0, 6});
  const SE3 view = lookAt({0, 0, 1}, {4, 0, 1});
  std::size_t triangles[2];
  for (const int half : {0, 1}) {
    SceneCamera camera;
    CameraIntrinsics k;
    k.width = 640 >> half, k.height = 480 >> half, k.fx = k.fy = 525 >> half;
    k.cx = 0.5 * (k.width - 1), k.cy = 0.5 * (k.height - 1);
    camera.camera = makeCamera(k);
    DepthMeshBuilder builder({}, camera.camera, camera.noise);
    const TrackedFrame frame = camera.frame(scene, view, 0, 8 >> half);
    triangles[half] = builder.build({}, frame.depth_grid, view.R().row(2)).triangles.size();
  }
  EXPECT_GT(triangles[0], 1000u);
  EXPECT_NEAR(double(triangles[0]), double(triangles[1]), 0.1 * double(triangles[0]));
}

TEST(Detection, HistogramKeepsSidesApartAndForgets) {
  PlaneHistogram histogram(0.05, 0.05, 3);
  histogram.addHorizontal({0, 0, 1}, {0, 0, 1.02}, 1.0, 0);
  histogram.addHorizontal({0, 0, -1}, {0, 0, 1.02}, 2.0, 1);
  histogram.addVertical({-1, 1e-9, 0}, {3, 0, 0}, 1.5, 2);
  histogram.addVertical({-1, -1e-9, 0}, {3, 0, 0}, 1.0, 3);  // the other side of +-180 degrees
  auto peak = histogram.peak();
  EXPECT_EQ((std::vector<int>{2, 3}), peak.members);
  EXPECT_DOUBLE_EQ(2.5, peak.area);
  histogram.remove(2);
  histogram.remove(3);
  EXPECT_EQ((std::vector<int>{1}), histogram.peak().members);
  histogram.remove(1);
  EXPECT_EQ((std::vector<int>{0}), histogram.peak().members);
  histogram.remove(0);
  EXPECT_EQ(0, histogram.peak().area);
}

TEST(Detection, HeightsAndDistancesHaveBinsOfTheirOwn) {
  PlaneHistogram histogram(0.5, 0.05, 3);
  histogram.addHorizontal({0, 0, 1}, {0, 0, 0.1}, 1.0, 0);
  histogram.addHorizontal({0, 0, 1}, {0, 0, 0.6}, 1.0, 1);  // a neighbour for bins of 0.5 m, not of 5 cm
  histogram.addVertical({1, 0, 0}, {0.1, 0, 0}, 0.9, 2);
  histogram.addVertical({1, 0, 0}, {0.6, 0, 0}, 0.9, 3);
  EXPECT_EQ((std::vector<int>{0, 1}), histogram.peak().members);
  histogram.remove(0);
  histogram.remove(1);
  EXPECT_EQ(1u, histogram.peak().members.size());
}

}  // namespace
}  // namespace vip_slam
