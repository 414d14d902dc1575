// SPDX-License-Identifier: BSD-3-Clause
// Scenes and their true planes; sequence definitions.
#include <gtest/gtest.h>

#include <fstream>

#include "test_support.h"
#include "vip_slam_sim/render/light_baker.h"

namespace vip_slam {
namespace {

double ringArea(const Ring& ring, const Eigen::Vector3d& n) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < ring.size(); ++i) sum += ring[i].cross(ring[(i + 1) % ring.size()]);
  return 0.5 * sum.dot(n);
}

TEST(Scenes, PlanesAreConsistentWithTheirPolygons) {
  for (const std::string& name : sceneNames()) {
    auto scene = std::make_shared<Scene>(buildScene(name));
    const VisibilityCounter nothing(scene);
    const std::vector<TruePlane> planes = truthPlanes(*scene, nothing);
    EXPECT_GT(planes.size(), 5u) << name;
    for (const TruePlane& p : planes) {
      double area = 0;
      for (const PlanePolygon& polygon : p.polygons) {
        area += ringArea(polygon.outer, p.plane.n);
        for (const Ring& hole : polygon.holes) area += ringArea(hole, p.plane.n);  // runs the other way round
        for (const Eigen::Vector3d& x : polygon.outer) EXPECT_LT(std::abs(p.plane.signedDistance(x)), 1e-4);
      }
      EXPECT_NEAR(area, p.area, 1e-3 * (1 + p.area)) << name << " plane " << p.id;
    }
  }
}

TEST(Scenes, OfficeIsLargeAndItsCorridorFloorIsOnePlane) {
  auto scene = std::make_shared<Scene>(buildScene("office"));
  const VisibilityCounter nothing(scene);
  const std::vector<TruePlane> planes = truthPlanes(*scene, nothing);
  const TruePlane* floor = nullptr;
  for (const TruePlane& p : planes)
    if (p.kind == PlaneKind::kHorizontal && p.plane.n.z() > 0 && (!floor || p.area > floor->area)) floor = &p;
  ASSERT_TRUE(floor);
  EXPECT_NEAR(floor->plane.d, 0, 1e-6);
  EXPECT_GT(floor->area, 500);                     // hall, corridors and rooms hang together
  EXPECT_FALSE(floor->polygons[0].holes.empty());  // the core
  Eigen::Vector3d lo = floor->polygons[0].outer[0], hi = lo;
  for (const Eigen::Vector3d& x : floor->polygons[0].outer) lo = lo.cwiseMin(x), hi = hi.cwiseMax(x);
  EXPECT_GE(hi.x() - lo.x(), 40);
  EXPECT_GE(hi.y() - lo.y(), 20);
}

TEST(Scenes, RayHitsAgreeWithTheRoomsWalls) {
  const Scene scene = buildScene("room");
  const RayTracer tracer(scene);
  RayBatch rays;
  rays.resize(2);
  rays.set(0, {0, 0, 3.6f}, {1, 0, 0});
  rays.set(1, {0, 0, 3.6f}, {0, -2, 0});  // direction of length 2: half the parameter
  tracer.intersect(&rays, 2, 0, false);
  EXPECT_NEAR(rays.t[0], 4.5, 1e-5);
  EXPECT_NEAR(rays.t[1], 1.75, 1e-5);
  EXPECT_NEAR(tracer.clearance({0, 0, 3.6f}, 1.0f), 0.4, 0.01);
}

TEST(Scenes, WallsAreWhiteButNotSaturated) {
  for (const std::string name : {"01", "07", "stairs", "alias", "attic", "gallery", "workshop", "foyer"}) {
    SequenceRenderer s(loadSequence(name, libraryPath()), quickOptions());
    double white = 0, sum = 0;
    int n = 0;
    for (int i = 10; i < s.frameCount(); i += s.frameCount() / 4) {
      const SimFrame f = s.renderFrame(i);
      for (int v = 0; v < 480; v += 4)
        for (int u = 0; u < 640; u += 4, ++n) {
          const int g = f.rgb.at<cv::Vec3b>(v, u)[1];
          white += g >= 254;
          sum += g;
        }
    }
    std::printf("  %s: mean %.0f, saturated %.1f %%\n", name.c_str(), sum / n, 100 * white / n);
    EXPECT_GT(sum / n, 90) << name;
    EXPECT_LT(sum / n, 215) << name;
    EXPECT_LT(white / n, 0.06) << name;
  }
}

TEST(Scenes, VisibilityCountsWhatTheCameraSaw) {
  SequenceSpec spec = loadSequence("still_wall", libraryPath());
  SequenceRenderer s(spec, quickOptions(0, 10));
  s.render([](const SimFrame&) { return true; });
  double longest = 0, area = 0;
  int seen = 0;
  for (const TruePlane& p : s.planes()) {
    if (p.seen_seconds > 0) ++seen;
    if (p.seen_seconds >= longest && p.seen_area > area) longest = p.seen_seconds, area = p.seen_area;
    EXPECT_LE(p.seen_area, p.area + 1e-9);
  }
  EXPECT_NEAR(longest, 0.5, 1e-9);  // ten frames at 20 Hz
  EXPECT_GT(area, 1.0);
  EXPECT_GE(seen, 1);
  EXPECT_LT(seen, 8);
}

TEST(Sequences, AllLoadAndErrorsNameTheKey) {
  for (const std::string& name : sequenceNames(libraryPath())) EXPECT_EQ(loadSequence(name, libraryPath()).name, name);
  const auto messageOf = [](const std::string& text) -> std::string {
    const std::string path = testing::TempDir() + "vip_slam_sim_bad.yaml";
    std::ofstream(path) << text;
    try {
      loadSequence(path, libraryPath());
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(messageOf("{base: smoke, seed: 5}"), "");
  EXPECT_NE(messageOf("{base: smoke, motion: {sped: 1}}").find("motion/sped"), std::string::npos);
  EXPECT_NE(messageOf("{base: smoke, camera: {rate: -3}}").find("camera/rate"), std::string::npos);
  EXPECT_NE(messageOf("{base: nothing}").find("nothing"), std::string::npos);
  EXPECT_NE(messageOf("{scene: moon}").find("moon"), std::string::npos);
  EXPECT_NE(messageOf("{scene: [office]}").find("scene"), std::string::npos);
  EXPECT_THROW(loadSequence("/nowhere.yaml", libraryPath()), std::runtime_error);
  EXPECT_THROW(loadSequence("no_such_name", libraryPath()), std::runtime_error);
}

TEST(Sequences, MotionThroughAWallIsRefused) {
  SequenceSpec spec = loadSequence("01", libraryPath());
  spec.motion.waypoints = "33,9; 20,9";  // into the core
  try {
    SequenceRenderer s(spec, quickOptions());
    FAIL() << "accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("motion/clearance"), std::string::npos);
  }
}

TEST(Sequences, PathsKeepClear) {
  for (const std::string name : {"01",       "02",      "03",      "04",          "05",      "long_loop",
                                 "stairs",   "alias",   "attic",   "attic_phone", "gallery", "gallery_robot",
                                 "workshop", "foyer",   "real_01", "real_02",     "real_03", "real_04",
                                 "real_05",  "real_06", "real_07"}) {
    SequenceSpec spec = loadSequence(name, libraryPath());
    EXPECT_TRUE(spec.motion.check_collisions);
    EXPECT_NO_THROW(SequenceRenderer(spec,
                                     [] {
                                       RenderOptions o = quickOptions();
                                       o.light_spacing_scale = 40;
                                       return o;
                                     }()))
        << name;
  }
}

}  // namespace
}  // namespace vip_slam
