// SPDX-License-Identifier: BSD-3-Clause
// Sensor and launch files against what the drivers do (driver_facts.h), value by value.
#include <algorithm>
#include <fstream>
#include <regex>

#include <gtest/gtest.h>

#include "driver_facts.h"
#include "vip_slam_ros/tf_lookup.h"

namespace vip_slam {
namespace {

using test_support::DriverCamera;

class DriverFacts : public testing::TestWithParam<DriverCamera> {
 protected:
  std::string sensorFile() const { return CONFIG_DIR "/sensors/" + GetParam().sensor + ".yaml"; }
};

TEST_P(DriverFacts, TheSensorFileSaysWhatTheDriverPublishes) {
  const SensorConfig ours = loadSensorConfig(sensorFile()), &driver = GetParam().published;
  EXPECT_EQ(ours.topics.color, driver.topics.color);
  EXPECT_EQ(ours.topics.color_info, driver.topics.color_info);
  EXPECT_EQ(ours.topics.depth, driver.topics.depth);
  EXPECT_EQ(ours.topics.depth_info, driver.topics.depth_info);
  EXPECT_EQ(ours.topics.imu, driver.topics.imu);
  EXPECT_EQ(ours.topics.gyro, driver.topics.gyro);
  EXPECT_EQ(ours.topics.accel, driver.topics.accel);
  EXPECT_EQ(ours.color_encoding, driver.color_encoding);
  EXPECT_EQ(ours.depth_encoding, driver.depth_encoding);
  EXPECT_EQ(ours.depth_scale, driver.depth_scale);
  EXPECT_TRUE(ours.depth_registered);
  EXPECT_EQ(ours.depth_undistorted, driver.depth_undistorted);
  EXPECT_EQ(ours.color_rate, driver.color_rate);
  EXPECT_EQ(ours.depth_rate, driver.depth_rate);
  EXPECT_EQ(ours.imu_rate, driver.imu_rate);
  EXPECT_NEAR(ours.time_offset, driver.time_offset, 2e-4);
  EXPECT_EQ(ours.camera.width, driver.camera.width);
  EXPECT_EQ(ours.camera.height, driver.camera.height);
  for (const std::string& type : GetParam().types)
    EXPECT_TRUE(type == "sensor_msgs/Image" || type == "sensor_msgs/Imu") << type;
}

TEST_P(DriverFacts, TheExtrinsicsAreThoseOfTheDriversFrames) {
  const SensorConfig ours = loadSensorConfig(sensorFile());
  const ExtrinsicsGap gap = extrinsicsGap(ours.T_imu_cam, GetParam().published.T_imu_cam);
  EXPECT_LT(gap.degrees, 3);  // as extrinsicsGap.large(), which check_bag warns of
  EXPECT_LT(gap.metres, 0.02);
}

TEST_P(DriverFacts, FramesNamedInTheSensorFileExist) {
  std::ifstream file(sensorFile());
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::regex frame("[a-z0-9_]+_(optical_frame|camera_frame|color_frame|gyro_frame|link)\\b");
  std::vector<std::string> known = GetParam().all_frames;
  known.push_back("base_link");
  for (std::sregex_iterator it(text.begin(), text.end(), frame), end; it != end; ++it)
    EXPECT_TRUE(std::count(known.begin(), known.end(), it->str())) << it->str() << " is no frame of the driver";
}

TEST_P(DriverFacts, TheLaunchFilePassesWhatTheDriverHas) {
  const DriverCamera& camera = GetParam();
  const auto include = test_support::readLaunch(CONFIG_DIR "/../launch/" + camera.name + ".launch", camera.launch);
  EXPECT_EQ(include.sensor, camera.sensor);
  EXPECT_EQ(include.ns, camera.ns);
  ASSERT_FALSE(camera.launch.branches.empty());
  for (const auto& [branch, arguments] : camera.launch.branches) {
    for (const auto& [name, value] : include.passed)
      EXPECT_TRUE(arguments.count(name)) << camera.launch.file << " has no argument " << name << " on branch "
                                         << branch;
    for (const auto& [name, value] : camera.needs) {
      const auto passed = include.passed.find(name);
      const auto standard = arguments.find(name);
      ASSERT_NE(standard, arguments.end()) << name << " is not in the table of branch " << branch;
      EXPECT_EQ(passed != include.passed.end() ? passed->second : standard->second, value) << name << ", " << branch;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shipped, DriverFacts, testing::ValuesIn(test_support::driverCameras()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace vip_slam
