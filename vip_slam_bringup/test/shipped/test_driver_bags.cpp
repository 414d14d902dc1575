// SPDX-License-Identifier: BSD-3-Clause
// Every shipped configuration with a bag as its driver writes it: check_bag reports no problem, and the offline
// pipeline tracks it. Bags of cameras are made from the tables of what the drivers do (driver_facts.h), so that a wrong
// topic, encoding, axis or geometry in a sensor file shows; where no driver is, from the sensor file itself.
#include <unistd.h>

#include <filesystem>

#include <gtest/gtest.h>

#include "driver_facts.h"
#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/recorder.h"
#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_bringup/runner/pipeline.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

SensorConfig shipped(const std::string& name) { return loadSensorConfig(CONFIG_DIR "/sensors/" + name + ".yaml"); }

fs::path bagPath(const std::string& name) {
  return fs::temp_directory_path() / ("vip_slam_driver_" + name + std::to_string(::getpid()) + ".bag");
}

/// Runs the bag and compares the motion of the body between the first tracked image and the last with the truth.
void expectTracked(const fs::path& bag, SensorConfig sensor, const Trajectory& truth) {
  BagReader reader(bag.string(), sensor);
  Pipeline pipeline(PipelineOptions(), sensor, nullptr);
  reader.start();
  while (const auto event = reader.next()) pipeline.add(*event);
  pipeline.finish();
  EXPECT_TRUE(reader.warnings().empty()) << reader.warnings().front();
  const auto& odometry = pipeline.odometry();
  ASSERT_GT(odometry.size(), 0.4 * truth.size());
  // The system starts at zero yaw, and without an accelerometer at the camera's axes: only motions are comparable.
  const auto at = [&](double t) {
    SE3 T;
    EXPECT_TRUE(poseAt(truth, t, &T)) << t;
    return T;
  };
  const SE3 moved = odometry.front().T_odom_I.inverse() * odometry.back().T_odom_I;
  const SE3 moved_true = at(odometry.front().t).inverse() * at(odometry.back().t);
  EXPECT_LT((moved.t() - moved_true.t()).norm(), 0.03);
  EXPECT_LT(moved.rotation().angularDistance(moved_true.rotation()), 0.03);
}

void expectReadyAndTracked(const std::string& name, test_support::DriverBagOptions options, SensorConfig sensor) {
  const fs::path bag = bagPath(name);
  options.still = 1.2;
  options.moving = std::max(1.5, 45 / options.sensor.color_rate);  // so that the motion can be measured
  const Trajectory truth = test_support::writeDriverBag(bag.string(), options);

  const Findings findings = checkAll(recordBag(bag.string(), sensor, 60));
  EXPECT_LT(static_cast<int>(worst(findings)), static_cast<int>(Severity::kWarning)) << toText(findings, false);
  bool motion_seen = false;
  for (const Finding& f : findings) motion_seen |= f.about == "extrinsics" && f.severity == Severity::kGood;
  EXPECT_TRUE(motion_seen) << toText(findings, false);
  expectTracked(bag, sensor, truth);
  fs::remove(bag);
}

class DriverBags : public testing::TestWithParam<test_support::DriverCamera> {};

TEST_P(DriverBags, IsReadyAndTracks) {
  expectReadyAndTracked(GetParam().name, GetParam().bag(), shipped(GetParam().sensor));
}

std::vector<test_support::DriverCamera> distinctCameras(bool inertial) {
  std::vector<test_support::DriverCamera> out;
  for (const auto& camera : test_support::driverCameras())
    if (camera.name == camera.sensor && camera.published.topics.hasInertial() == inertial) out.push_back(camera);
  return out;
}

INSTANTIATE_TEST_SUITE_P(Shipped, DriverBags, testing::ValuesIn(distinctCameras(true)),
                         [](const auto& info) { return info.param.name; });

class BagsWithoutDriver : public testing::TestWithParam<const char*> {};

TEST_P(BagsWithoutDriver, IsReadyAndTracks) {
  test_support::DriverBagOptions options;
  options.sensor = shipped(GetParam());
  expectReadyAndTracked(GetParam(), options, options.sensor);
}

INSTANTIATE_TEST_SUITE_P(Shipped, BagsWithoutDriver, testing::Values("phone", "euroc", "simulator", "rgbd_imu"),
                         [](const auto& info) { return std::string(info.param); });

class DriverBagsWithoutImu : public testing::TestWithParam<test_support::DriverCamera> {};

TEST_P(DriverBagsWithoutImu, IsReadyAndTracks) {
  const fs::path bag = bagPath(GetParam().name);
  SensorConfig sensor = shipped(GetParam().sensor);
  const Trajectory truth = test_support::writeDriverBag(bag.string(), GetParam().bag());
  const Findings findings = checkAll(recordBag(bag.string(), sensor, 60));
  EXPECT_LT(static_cast<int>(worst(findings)), static_cast<int>(Severity::kWarning)) << toText(findings, false);
  EXPECT_NE(toText(findings, false).find("an RGB-D camera alone"), std::string::npos) << toText(findings, false);

  BagReader reader(bag.string(), sensor);
  reader.start();
  std::size_t images = 0, others = 0;
  while (const auto event = reader.next()) ++(std::holds_alternative<ImagePair>(*event) ? images : others);
  EXPECT_GT(images, 70u);
  EXPECT_EQ(others, 0u);
  sensor.rolling_shutter = 0;  // the bag's images are of one moment
  expectTracked(bag, sensor, truth);
  fs::remove(bag);
}

INSTANTIATE_TEST_SUITE_P(Shipped, DriverBagsWithoutImu, testing::ValuesIn(distinctCameras(false)),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace vip_slam
