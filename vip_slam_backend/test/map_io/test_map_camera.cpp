// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstring>

#include "back_end/checked_back_end.h"
#include "map_io/synthetic_map.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_backend/util/crc32.h"

namespace vip_slam {
namespace {

CameraIntrinsics camera() {
  CameraIntrinsics k;
  k.width = 640;
  k.height = 480;
  k.fx = 615.25;
  k.fy = 614.5;
  k.cx = 321.125;
  k.cy = 238.75;
  k.model = DistortionModel::kRadTan;
  k.distortion = {0.1, -0.2, 0.001, -0.002, 0.05};
  return k;
}

std::string refusal(const StoredMap& stored, const CameraIntrinsics& now) {
  try {
    requireCamera(stored, now, "test.vsm");
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(MapCamera, ComesBack) {
  const Map map = syntheticMap(3, 12, 100);
  const std::string bytes = serialiseMap(map, {}, 1, camera());
  const StoredMap stored = parse(bytes);
  ASSERT_TRUE(stored.camera.has_value());
  const CameraIntrinsics &a = *stored.camera, b = camera();
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.fx, b.fx);
  EXPECT_EQ(a.fy, b.fy);
  EXPECT_EQ(a.cx, b.cx);
  EXPECT_EQ(a.cy, b.cy);
  EXPECT_EQ(a.model, b.model);
  EXPECT_EQ(a.distortion, b.distortion);
  EXPECT_EQ(serialiseMap(stored.map, stored.loops, stored.vocabulary_id, stored.camera), bytes);
}

TEST(MapCamera, AVersion4FileIsReadWithout) {
  Map map = syntheticMap(3, 12, 100);
  constexpr double kScale = 1.2345678901;
  for (const KeyframeId id : {1, 2, 3}) map.widenImuNoise(id, kScale, ImuNoise());
  std::string bytes = serialiseMap(map, {}, 1);
  bytes.erase(24 + 8, 1);  // the flag for "no camera stored"
  const std::string scale(reinterpret_cast<const char*>(&kScale), sizeof kScale);
  int scales = 0;  // stored per keyframe since version 6, and behind it those of two random walks since version 7
  for (std::size_t at; (at = bytes.find(scale)) != std::string::npos; ++scales) bytes.erase(at, 3 * sizeof kScale);
  ASSERT_EQ(scales, 3);
  bytes[8] = 4;
  const std::uint64_t length = bytes.size() - 24 - 4;
  std::memcpy(&bytes[16], &length, 8);
  const std::uint32_t crc = crc32(bytes.data(), bytes.size() - 4);
  std::memcpy(&bytes[bytes.size() - 4], &crc, 4);
  const StoredMap stored = parse(bytes);
  EXPECT_EQ(stored.map.keyframes().size(), 3u);
  EXPECT_FALSE(stored.camera.has_value());
  EXPECT_EQ(refusal(stored, camera()), "");
}

TEST(MapCamera, AnotherOneIsRefusedByName) {
  StoredMap stored;
  stored.camera = camera();
  CameraIntrinsics now = camera();
  now.fx *= 1.009;  // another calibration of the same camera
  now.distortion.clear();
  EXPECT_EQ(refusal(stored, now), "");
  now.fy *= 1.02;
  EXPECT_EQ(
      refusal(stored, now),
      "test.vsm: made with images of 640 x 480 pixels, fx 615.2, fy 614.5, cx 321.1, cy 238.8, but the camera now "
      "has 640 x 480 pixels, fx 620.8, fy 626.8, cx 321.1, cy 238.8; expected the same size and lens, focal lengths "
      "within 1 % and the centre within 5 % of the width");
  now = camera();
  now.cx += 25;  // a change as after recalibration
  EXPECT_EQ(refusal(stored, now), "");
  now.cx += 15;
  EXPECT_NE(refusal(stored, now).find("cx 361.1"), std::string::npos) << refusal(stored, now);
  now = camera();
  now.model = DistortionModel::kEquidistant;
  EXPECT_NE(refusal(stored, now).find("cy 238.8, fisheye; expected"), std::string::npos) << refusal(stored, now);
  now = camera().scaled(848, 480);
  EXPECT_NE(refusal(stored, now).find("but the camera now has 848 x 480"), std::string::npos) << refusal(stored, now);
}

TEST(MapCamera, NobodyLoadsAMapOfAnotherCamera) {
  const std::string path = ::testing::TempDir() + "another_camera.vsm";
  SensorConfig sensor;
  sensor.topics.imu = "/imu";
  sensor.camera = camera();
  saveMapFile(path, syntheticMap(3, 12, 100), {}, 1, sensor.camera);
  CheckedBackEnd same(BackEndOptions(), sensor);
  EXPECT_EQ(same.loadMap(path).keyframes.size(), 3u);
  same.saveMap(path);  // with its camera
  sensor.camera = camera().scaled(320, 240);
  CheckedBackEnd other(BackEndOptions(), sensor);
  try {
    other.loadMap(path);
    FAIL() << "taken";
  } catch (const std::runtime_error& e) {
    EXPECT_EQ(std::string(e.what()).rfind(path + ": made with images of 640 x 480", 0), 0u) << e.what();
  }
  EXPECT_TRUE(other.map().empty());
}

}  // namespace
}  // namespace vip_slam
