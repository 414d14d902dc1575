// SPDX-License-Identifier: BSD-3-Clause
// Every shipped sensor file loads, has all keys, survives saving, and has plausible values.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "vip_slam_bringup/stereo/stereo_depth.h"
#include "vip_slam_core/sensor/sensor_config.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

std::vector<fs::path> shipped() {
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(CONFIG_DIR "/sensors"))
    if (entry.path().extension() == ".yaml") out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

/// Cameras without IMU lack its section.
bool hasImu(const fs::path& path) { return loadSensorConfig(path.string()).topics.hasInertial(); }

std::set<std::string> keysOf(const YAML::Node& node, const std::string& prefix = "") {
  std::set<std::string> out;
  for (const auto& entry : node) {
    const std::string key = prefix + entry.first.as<std::string>();
    out.insert(key);
    if (entry.second.IsMap())
      for (const auto& inner : keysOf(entry.second, key + "/")) out.insert(inner);
  }
  return out;
}

TEST(SensorFiles, AllSensorsAreThere) {
  std::set<std::string> names;
  for (const auto& path : shipped()) names.insert(path.stem().string());
  for (const char* name :
       {"d435i",        "d435i_split", "d455",  "d455_split", "l515",      "l515_split", "azure_kinect",
        "orbbec_femto", "oak_d",       "phone", "euroc",      "simulator", "d435",       "xtion",
        "kinect_v1",    "kinect_v2",   "astra", "rgbd_imu",   "d456",      "d457",       "orbbec_femto_split",
        "gemini_330",   "zed2",        "zed2i", "zedm"})
    EXPECT_TRUE(names.count(name)) << name;
}

TEST(SensorFiles, EachLoadsAndIsPlausible) {
  for (const auto& path : shipped()) {
    SCOPED_TRACE(path.string());
    const SensorConfig sensor = loadSensorConfig(path.string());
    EXPECT_EQ(sensor.name, path.stem().string());
    EXPECT_FALSE(sensor.topics.color.empty());
    EXPECT_FALSE(sensor.topics.depth.empty());
    EXPECT_FALSE(sensor.topics.color_info.empty());
    // Either a combined IMU stream or separate ones, not both; or none, and then the body is the camera.
    EXPECT_EQ(sensor.topics.gyro.empty(), sensor.topics.accel.empty());
    if (sensor.topics.hasInertial())
      EXPECT_NE(sensor.topics.imu.empty(), sensor.topics.gyro.empty());
    else
      EXPECT_LT(sensor.T_imu_cam.boxminus(SE3()).norm(), 1e-12);
    EXPECT_EQ(sensor.camera.validate(), "");
    EXPECT_EQ(sensor.depth_noise.validate(), "");
    EXPECT_LT(sensor.T_imu_cam.t().norm(), 0.15);
    // Between a tactical-grade and a bad consumer IMU.
    EXPECT_GT(sensor.imu_noise.gyro_noise_density, 5e-5);
    EXPECT_LT(sensor.imu_noise.gyro_noise_density, 1e-2);
    EXPECT_GT(sensor.imu_noise.accel_noise_density, 5e-4);
    EXPECT_LT(sensor.imu_noise.accel_noise_density, 1e-1);
    EXPECT_LT(sensor.depth_noise.sigma(2.0), 0.05);
    EXPECT_GT(sensor.depth_noise.sigma(2.0), 0.001);
  }
}

TEST(SensorFiles, AllHaveTheSameKeysAndTheReadmeNamesThem) {
  std::ifstream readme(CONFIG_DIR "/sensors/README.md");
  const std::string text((std::istreambuf_iterator<char>(readme)), std::istreambuf_iterator<char>());
  const auto expected = keysOf(YAML::LoadFile(CONFIG_DIR "/sensors/simulator.yaml"));
  auto without_imu = expected;
  for (auto key = without_imu.begin(); key != without_imu.end();)
    key = *key == "imu" || key->rfind("imu/", 0) == 0 ? without_imu.erase(key) : std::next(key);
  for (const auto& path : shipped()) {
    EXPECT_EQ(keysOf(YAML::LoadFile(path.string())), hasImu(path) ? expected : without_imu) << path;
    EXPECT_NE(text.find("`" + path.stem().string() + "`"), std::string::npos) << path << " is not in README.md";
  }
  for (const std::string& key : expected) {
    const auto next = expected.upper_bound(key);
    if (next != expected.end() && next->rfind(key + "/", 0) == 0) continue;  // a section, not a value
    const std::string last = key.substr(key.rfind('/') == std::string::npos ? 0 : key.rfind('/') + 1);
    EXPECT_TRUE(text.find("`" + key + "`") != std::string::npos || text.find("`" + last + "`") != std::string::npos)
        << key << " is not in README.md";
  }
}

TEST(SensorFiles, SavingAndLoadingChangesNothing) {
  const std::string copy =
      (fs::temp_directory_path() / ("vip_slam_sensor_" + std::to_string(::getpid()) + ".yaml")).string();
  for (const auto& path : shipped()) {
    SCOPED_TRACE(path.string());
    const SensorConfig sensor = loadSensorConfig(path.string());
    saveSensorConfig(copy, sensor);
    const SensorConfig again = loadSensorConfig(copy);
    EXPECT_EQ(again.topics.color, sensor.topics.color);
    EXPECT_EQ(again.depth_encoding, sensor.depth_encoding);
    EXPECT_EQ(again.depth_undistorted, sensor.depth_undistorted);
    EXPECT_LT((again.T_imu_cam.matrix() - sensor.T_imu_cam.matrix()).norm(), 1e-12);
    EXPECT_EQ(again.depth_noise.c, sensor.depth_noise.c);
    EXPECT_EQ(keysOf(YAML::LoadFile(copy)), keysOf(YAML::LoadFile(path.string())));
  }
  fs::remove(copy);
}

TEST(SensorFiles, EurocFollowsFromItsStereoCalibration) {
  const SensorConfig sensor = loadSensorConfig(CONFIG_DIR "/sensors/euroc.yaml");
  const StereoDepth stereo(loadStereoCalibration(CONFIG_DIR "/stereo/euroc.yaml"), StereoDepthOptions());
  EXPECT_LT((sensor.T_imu_cam.matrix() - stereo.T_imu_rectified().matrix()).norm(), 1e-4);
  EXPECT_NEAR(sensor.camera.fx, stereo.rectified().fx, 0.05);
  EXPECT_NEAR(sensor.camera.cx, stereo.rectified().cx, 0.05);
  EXPECT_NEAR(sensor.camera.cy, stereo.rectified().cy, 0.05);
  EXPECT_NEAR(sensor.depth_noise.c, 0.5 / (stereo.rectified().fx * stereo.baseline()), 1e-4);
}

}  // namespace
}  // namespace vip_slam
