// SPDX-License-Identifier: BSD-3-Clause
// EuRoC's folders on tiny ones: the bag's content, and the errors for unreadable folders.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iterator>

#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <opencv2/imgcodecs.hpp>

#include "converted_folder.h"
#include "vip_slam_bringup/convert/converters.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

constexpr long long kStart = 1403715273262142976LL;

class EurocConverter : public test_support::ConvertedFolder {
 protected:
  void makeFolder() {
    const std::string camera_yaml =
        "resolution: [96, 64]\nintrinsics: [80.0, 80.0, 48.0, 32.0]\ndistortion_model: radial-tangential\n"
        "distortion_coefficients: [0.0, 0.0, 0.0, 0.0]\nT_BS:\n  data: [1,0,0,";
    write("set/mav0/cam0/sensor.yaml", camera_yaml + "0.0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n");
    write("set/mav0/cam1/sensor.yaml", camera_yaml + "0.1, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n");
    write("set/mav0/imu0/sensor.yaml",
          "gyroscope_noise_density: 1.6968e-04\ngyroscope_random_walk: 1.9393e-05\n"
          "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n");
    std::string images = "#timestamp [ns],filename\n", imu = "#timestamp,wx,wy,wz,ax,ay,az\n";
    cv::RNG rng(3);
    for (int i = 0; i < 3; ++i) {
      const std::string stamp = std::to_string(kStart + i * 50000000LL);
      images += stamp + "," + stamp + ".png\n";
      cv::Mat image(64, 96, CV_8UC1);
      rng.fill(image, cv::RNG::UNIFORM, 0, 255);
      writeImage("set/mav0/cam0/data/" + stamp + ".png", image);
      writeImage("set/mav0/cam1/data/" + stamp + ".png", image);
    }
    for (int i = 0; i < 20; ++i) imu += std::to_string(kStart + i * 5000000LL) + ",0.1,0.2,0.3,9.8,0.5,-0.25\n";
    write("set/mav0/cam0/data.csv", images);
    write("set/mav0/cam1/data.csv", images);
    write("set/mav0/imu0/data.csv", imu);
    write("set/mav0/state_groundtruth_estimate0/data.csv",
          "#timestamp,px,py,pz,qw,qx,qy,qz\n" + std::to_string(kStart) + ",1,2,3,1,0,0,0\n");
    options_.folder = (root_ / "set").string();
    options_.bag = bag_;
    options_.stereo.num_disparities = 16;
  }
  EurocOptions options_;
};

TEST_F(EurocConverter, KeepsStampsPixelsAndInertialData) {
  makeFolder();
  options_.depth = true;
  const ConversionReport report = convertEuroc(options_);
  EXPECT_EQ(report.files.size(), 3u);
  for (const auto& file : report.files) EXPECT_TRUE(fs::exists(file)) << file;

  const auto left = read<sensor_msgs::Image>("/cam0/image_raw");
  ASSERT_EQ(left.size(), 3u);
  EXPECT_EQ(left[1]->header.stamp.toNSec(), std::uint64_t(kStart + 50000000LL));
  EXPECT_EQ(left[1]->encoding, "mono8");
  const cv::Mat png = cv::imread((root_ / "set/mav0/cam0/data" / (std::to_string(kStart) + ".png")).string(), 0);
  EXPECT_EQ(0, memcmp(left[0]->data.data(), png.data, 64 * 96));
  EXPECT_EQ(read<sensor_msgs::Image>("/cam1/image_raw").size(), 3u);

  const auto imu = read<sensor_msgs::Imu>("/imu0");
  ASSERT_EQ(imu.size(), 20u);
  EXPECT_DOUBLE_EQ(imu[3]->angular_velocity.z, 0.3);
  EXPECT_DOUBLE_EQ(imu[3]->linear_acceleration.x, 9.8);

  const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
  const auto depth = read<sensor_msgs::Image>(sensor.topics.depth);
  ASSERT_EQ(depth.size(), 3u);
  EXPECT_EQ(depth[0]->encoding, sensor.depth_encoding);
  EXPECT_EQ(read<sensor_msgs::CameraInfo>(sensor.topics.color_info).size(), 3u);
  EXPECT_EQ(read<sensor_msgs::Image>(sensor.topics.color)[0]->encoding, sensor.color_encoding);
  EXPECT_DOUBLE_EQ(sensor.imu_noise.gyro_noise_density, 1.6968e-04);

  const Trajectory truth = readTum((root_ / "out_truth.tum").string());
  ASSERT_EQ(truth.size(), 1u);
  EXPECT_NEAR(truth[0].T_W_B.t().z(), 3, 1e-12);
}

TEST_F(EurocConverter, NamesFileAndLine) {
  makeFolder();
  write("set/mav0/imu0/data.csv", "#t,wx,wy,wz,ax,ay,az\n" + std::to_string(kStart) + ",0,0,abc,0,0,0\n");
  const std::string number = errorOf([&] { convertEuroc(options_); });
  EXPECT_NE(number.find("imu0/data.csv:2: gyro z is 'abc', expected a number"), std::string::npos) << number;

  makeFolder();
  fs::remove(root_ / "set/mav0/cam1/data" / (std::to_string(kStart + 50000000LL) + ".png"));
  const std::string missing = errorOf([&] { convertEuroc(options_); });
  EXPECT_NE(missing.find("cam1/data.csv:3: image"), std::string::npos) << missing;

  makeFolder();
  write("set/mav0/cam0/data/" + std::to_string(kStart + 100000000LL) + ".png", "not a png");
  const std::string broken = errorOf([&] { convertEuroc(options_); });
  EXPECT_NE(broken.find("is not a readable image"), std::string::npos) << broken;

  options_.folder = (root_ / "nothing").string();
  EXPECT_NE(errorOf([&] { convertEuroc(options_); }).find("expected a EuRoC folder"), std::string::npos);
}

TEST_F(EurocConverter, NamesWhatIsWrongInTheCalibration) {
  makeFolder();
  std::ifstream file(root_ / "set/mav0/cam0/sensor.yaml");
  const std::string good((std::istreambuf_iterator<char>(file)), {});
  const auto changed = [&](const std::string& from, const std::string& to, const std::string& what) {
    std::string content = good;
    const auto at = content.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write("set/mav0/cam0/sensor.yaml", content.replace(at, from.size(), to));
    const std::string error = errorOf([&] { convertEuroc(options_); });
    EXPECT_NE(error.find("cam0/sensor.yaml: " + what), std::string::npos) << error;
  };
  changed("radial-tangential", "omni", "distortion_model: 'omni', expected radial-tangential or equidistant");
  changed("intrinsics", "intrinsic", "intrinsics: missing, expected 4 numbers");
  changed("[80.0, 80.0, 48.0, 32.0]", "[80.0, 80.0]", "intrinsics: 2 numbers, expected 4 numbers");
  changed("[80.0, 80.0, 48.0, 32.0]", "here", "intrinsics: not a list of numbers, expected 4 numbers");
  changed("T_BS", "T_SB", "T_BS/data: missing, expected 16 numbers");
  changed("data: [1,", "data: [2,", "T_BS/data: not a rigid transform: the rotation is off orthonormal by 3");
}

TEST_F(EurocConverter, DoesNotOverwriteUnasked) {
  makeFolder();
  convertEuroc(options_);
  EXPECT_THROW(convertEuroc(options_), std::runtime_error);
  // The bag's companion files may have been edited since.
  fs::remove(bag_);
  const std::string sensor = bag_.substr(0, bag_.size() - 4) + "_sensor.yaml";
  try {
    convertEuroc(options_);
    FAIL() << "the sensor file was overwritten";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).find(sensor + ": exists already"), 0u) << error.what();
  }
  options_.overwrite = true;
  EXPECT_NO_THROW(convertEuroc(options_));
}

TEST_F(EurocConverter, ABagThatFailsLeavesWhatLiesBesideTheOldOne) {
  makeFolder();
  convertEuroc(options_);
  options_.overwrite = true;
  write("set/mav0/cam0/data/" + std::to_string(kStart + 100000000LL) + ".png", "not a png");
  EXPECT_THROW(convertEuroc(options_), std::runtime_error);
  const std::string stem = bag_.substr(0, bag_.size() - 4);
  for (const std::string& file : {bag_, stem + "_sensor.yaml", stem + "_truth.tum"})
    EXPECT_TRUE(fs::exists(file)) << file;
}

}  // namespace
}  // namespace vip_slam
