// SPDX-License-Identifier: BSD-3-Clause
// Where run_bag takes the extrinsics from: tf in the bag, or the sensor file.
#include <unistd.h>

#include <filesystem>

#include <gtest/gtest.h>

#include "driver_bag.h"
#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_core/geometry/so3.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

/// A bag of two images whose tf has `truth`, read with a sensor file that has `T_imu_cam`.
class BagExtrinsicsTest : public testing::Test {
 protected:
  void SetUp() override {
    options_.sensor = loadSensorConfig(CONFIG_DIR "/sensors/phone.yaml");
    options_.still = 0.05;
    options_.moving = 0.05;
    path_ = (fs::temp_directory_path() / ("vip_slam_extrinsics_" + std::to_string(::getpid()) + ".bag")).string();
    turned_ = options_.sensor.T_imu_cam * SE3(expQuaternion({0, 0.1, 0}), {0, 0, 0});
  }
  void TearDown() override { fs::remove(path_); }

  /// The extrinsics passed to the estimators.
  SE3 read(const SE3& T_imu_cam, const std::string& extrinsics) {
    test_support::writeDriverBag(path_, options_);
    SensorConfig sensor = options_.sensor;
    sensor.T_imu_cam = T_imu_cam;
    BagReaderOptions reading;
    reading.extrinsics = extrinsics;
    BagReader reader(path_, sensor, reading);
    warnings_ = reader.warnings();
    source_ = reader.extrinsicsSource();
    return sensor.T_imu_cam;
  }
  static double apart(const SE3& a, const SE3& b) { return a.boxminus(b).norm(); }

  test_support::DriverBagOptions options_;
  std::string path_, source_;
  SE3 turned_;
  std::vector<std::string> warnings_;
};

TEST_F(BagExtrinsicsTest, TfGoesBeforeTheSensorFile) {
  EXPECT_LT(apart(read(turned_, "auto"), options_.sensor.T_imu_cam), 1e-9);
  EXPECT_NE(source_.find("tf: camera_color_optical_frame to "), std::string::npos) << source_;
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_NE(warnings_[0].find("5.7 degrees"), std::string::npos) << warnings_[0];
}

TEST_F(BagExtrinsicsTest, AgreementNeedsNoWords) {
  EXPECT_LT(apart(read(options_.sensor.T_imu_cam, "tf"), options_.sensor.T_imu_cam), 1e-9);
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(BagExtrinsicsTest, TheSensorFileWhenToldSo) {
  EXPECT_LT(apart(read(turned_, "config"), turned_), 1e-12);
  EXPECT_EQ(source_, "sensor file");
}

TEST_F(BagExtrinsicsTest, TheSensorFileWhenTfIsNotThere) {
  options_.tf = false;
  EXPECT_LT(apart(read(turned_, "auto"), turned_), 1e-12);
  EXPECT_EQ(source_, "sensor file");
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(BagExtrinsicsTest, TfThatIsDemandedAndMissingIsNamed) {
  options_.tf = false;
  try {
    read(turned_, "tf");
    FAIL() << "expected an error";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("camera_color_optical_frame"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace vip_slam
