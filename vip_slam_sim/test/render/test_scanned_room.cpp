// SPDX-License-Identifier: BSD-3-Clause
// Rooms from a headset's scan: mesh, labelled planes, errors.
#include <gtest/gtest.h>

#include <fstream>

#include "test_support.h"

namespace vip_slam {
namespace {

std::string meetingRoom() { return std::string(VIP_SLAM_SIM_SOURCE_DIR) + "/scenes/meeting_room.json"; }

TEST(ScannedRoom, HasItsLabelledPlanesAtTheMesh) {
  auto scene = std::make_shared<Scene>(buildScene(meetingRoom()));
  EXPECT_GT(scene->triangles.size(), 16000u);
  const VisibilityCounter nothing(scene);
  const std::vector<TruePlane> planes = truthPlanes(*scene, nothing);
  int horizontal = 0, walls = 0;
  double floor = 0;
  for (const TruePlane& p : planes) {
    const double up = p.plane.n.z();
    horizontal += std::abs(up) > 0.99;
    walls += std::abs(up) < 0.05;
    if (up > 0.99) floor = std::max(floor, p.area);
  }
  EXPECT_EQ(horizontal, 3);  // floor, ceiling, table
  EXPECT_EQ(walls, 8);       // of at least a square metre or near it
  EXPECT_NEAR(floor, 21.9, 0.1);
  // The mesh is closed: no ray from the middle escapes, and most end on a labelled plane, within 2 cm of it.
  const RayTracer tracer(*scene);
  RayBatch rays;
  constexpr int kRays = 4000;
  rays.resize(kRays);
  for (int i = 0; i < kRays; ++i) {
    const float z = 1 - 2 * (float(i) + 0.5f) / kRays, r = std::sqrt(1 - z * z), a = 2.39996323f * float(i);
    rays.set(i, {0.1f, 0.3f, 1.5f}, {r * std::cos(a), r * std::sin(a), z}, 20);
  }
  tracer.intersect(&rays, kRays, 0, false);
  int labelled = 0, near = 0;
  for (int i = 0; i < kRays; ++i) {
    ASSERT_GE(rays.piece[i], 0);
    const int surface = scene->surfaceOf(rays.piece[i]);
    if (surface < 0) continue;
    const Chart& c = scene->charts[scene->surfaces[surface].frame_chart];
    const Vec3 p = Vec3{rays.ox[i], rays.oy[i], rays.oz[i]} + Vec3{rays.dx[i], rays.dy[i], rays.dz[i]} * rays.t[i];
    ++labelled;
    near += std::abs(dot(p - c.o, c.n)) < 0.02f;
    EXPECT_GT(dot(scene->normalOf(rays.piece[i]), c.n), 0.85f);
  }
  std::printf("  %d of %d rays end on labelled planes, %d of them within 2 cm\n", labelled, kRays, near);
  EXPECT_GT(labelled, 0.6 * kRays);
  EXPECT_GT(near, 0.75 * labelled);
}

TEST(ScannedRoom, IsLitAndItsPathKeepsClear) {
  RenderOptions options = quickOptions();
  SequenceRenderer s(loadSequence("real_07", libraryPath()), options);
  for (int i = 0; i < s.frameCount(); i += s.frameCount() / 4) {
    const SimFrame f = s.renderFrame(i);
    cv::Scalar mean, spread;
    cv::meanStdDev(f.rgb, mean, spread);
    EXPECT_NEAR(mean[1], 110, 40) << i;
    EXPECT_GT(spread[1], 12) << i;  // there is something to see
  }
}

TEST(ScannedRoom, BadFilesAreNamed) {
  const auto messageOf = [](const std::string& text) -> std::string {
    const std::string path = testing::TempDir() + "vip_slam_sim_bad_room.json";
    std::ofstream(path) << text;
    try {
      buildScene(path);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(messageOf("{}").find("spatialEntities"), std::string::npos);
  EXPECT_NE(messageOf("{\"spatialEntities\": []}").find("no triangle mesh"), std::string::npos);
  const std::string pose =
      "\"locatable_META\": {\"position\": {\"x\": 0, \"y\": 0, \"z\": 0}, \"orientation\": {\"x\": 0, \"y\": 0, \"z\": "
      "0, \"w\": 1}}";
  EXPECT_NE(messageOf("{\"spatialEntities\": [{" + pose +
                      ", \"triangleMesh_META\": {\"vertices\": \"AAA*\", \"indices\": \"\"}}]}")
                .find("base 64"),
            std::string::npos);
  EXPECT_NE(messageOf("{\"spatialEntities\": [{" + pose +
                      ", \"triangleMesh_META\": {\"vertices\": \"\", \"indices\": \"AAAAAAAAAAAAAAAA\"}}]}")
                .find("not there"),
            std::string::npos);
  EXPECT_NE(messageOf("{\"spatialEntities\": [{\"triangleMesh_META\": {\"vertices\": \"\", \"indices\": \"\"}}]}")
                .find("no pose"),
            std::string::npos);
  EXPECT_THROW(buildScene("$NO_SUCH_FOLDER/room.json"), std::runtime_error);
}

}  // namespace
}  // namespace vip_slam
