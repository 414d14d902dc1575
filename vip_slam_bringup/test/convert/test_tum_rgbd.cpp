// SPDX-License-Identifier: BSD-3-Clause
// TUM RGB-D folders on tiny ones: the bag's content, and the errors for unreadable folders.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>

#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "converted_folder.h"
#include "vip_slam_bringup/convert/converters.h"
#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/formatted.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

class TumConverter : public test_support::ConvertedFolder {
 protected:
  void makeFolder(const std::string& name) {
    std::string rgb = "# color images\n", depth = "# depth maps\n";
    for (int i = 0; i < 4; ++i) {
      char line[96];
      std::snprintf(line, sizeof(line), "%.6f rgb/%d.png\n", 1305031102.1 + 0.033 * i, i);
      rgb += line;
      std::snprintf(line, sizeof(line), "%.6f depth/%d.png\n", 1305031102.11 + 0.033 * i, i);
      depth += line;
      writeImage(name + "/rgb/" + std::to_string(i) + ".png", cv::Mat(480, 640, CV_8UC3, cv::Scalar(10, 20, 30)));
      writeImage(name + "/depth/" + std::to_string(i) + ".png", cv::Mat(480, 640, CV_16UC1, cv::Scalar(7500)));
    }
    write(name + "/rgb.txt", rgb);
    write(name + "/depth.txt", depth);
    write(name + "/groundtruth.txt",
          "# t x y z qx qy qz qw\n1305031102.1 1 2 3 0 0 0 1\n1305031102.2 1 2 3.5 0 0 0 1\n");
    options_.folder = (root_ / name).string();
    options_.bag = bag_;
  }
  std::string words_, warning_;  ///< of a conversion, the first each
  TumRgbdOptions options_;
};

TEST_F(TumConverter, WithoutAnImuTheBagHasImagesAndTheSensorFileSaysSo) {
  makeFolder("rgbd_dataset_freiburg1_xyz");
  const ConversionReport report = convertTumRgbd(options_);
  EXPECT_TRUE(report.warnings.empty());
  EXPECT_EQ(report.messages.size(), 4u);  // images and their calibrations
  const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
  EXPECT_FALSE(sensor.hasGyro());
  EXPECT_FALSE(sensor.hasAccel());
  EXPECT_EQ(sensor.rolling_shutter, 0.025) << "a Kinect v1's";
  EXPECT_LT(sensor.T_imu_cam.boxminus(SE3()).norm(), 1e-12);  // so that the truth is the colour camera's
  EXPECT_NEAR(sensor.camera.fx, 517.3, 1e-9);
  const auto depth = read<sensor_msgs::Image>(sensor.topics.depth);
  ASSERT_EQ(depth.size(), 4u);
  const auto* value = reinterpret_cast<const std::uint16_t*>(depth[0]->data.data());
  EXPECT_NEAR(value[5] * sensor.depth_scale, 1.5, 1e-9);
  const auto color = read<sensor_msgs::Image>(sensor.topics.color);
  EXPECT_EQ(color[0]->encoding, sensor.color_encoding);
  EXPECT_EQ(color[0]->data[0], 10);
  EXPECT_EQ(readTum((root_ / "out_truth.tum").string()).size(), 2u);
}

TEST_F(TumConverter, TheKinectsAccelerometerComesInTheCamerasAxes) {
  makeFolder("rgbd_dataset_freiburg1_xyz");
  // The camera looks down by half a right angle: up lies along -y and -z of its own axes.
  write("rgbd_dataset_freiburg1_xyz/accelerometer.txt",
        "# t ax ay az\n1305031090 0 0 9.8\n1305031102.1 0.5 7 -7\n1305031102.102 0.5 7 -7\n1305031102.2 0 7 -7\n");
  EXPECT_TRUE(convertTumRgbd(options_).warnings.empty());
  const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
  EXPECT_FALSE(sensor.hasGyro());
  EXPECT_TRUE(sensor.hasAccel());
  EXPECT_EQ(sensor.imu_rate, 10);
  EXPECT_LT(sensor.T_imu_cam.boxminus(SE3()).norm(), 1e-12);
  const auto samples = read<sensor_msgs::Imu>(sensor.topics.accel);
  ASSERT_EQ(samples.size(), 2u);  // without the one long before the images, and the one that was read again
  EXPECT_EQ(samples[0]->angular_velocity_covariance[0], -1);  // not measured
  EXPECT_EQ(samples[0]->linear_acceleration.x, -0.5);
  EXPECT_EQ(samples[0]->linear_acceleration.y, -7);
  EXPECT_EQ(samples[0]->linear_acceleration.z, -7);
  EXPECT_EQ(samples[0]->header.frame_id, read<sensor_msgs::Image>(sensor.topics.color)[0]->header.frame_id);
  options_.no_imu = options_.overwrite = true;
  EXPECT_EQ(convertTumRgbd(options_).messages.size(), 4u);
  EXPECT_FALSE(loadSensorConfig((root_ / "out_sensor.yaml").string()).hasAccel());
}

TEST_F(TumConverter, ABagThatReplacesAnotherLeavesNoTruthOfThat) {
  makeFolder("rgbd_dataset_freiburg1_xyz");
  convertTumRgbd(options_);
  const std::string truth = bag_.substr(0, bag_.size() - 4) + "_truth.tum";
  ASSERT_TRUE(fs::exists(truth));
  fs::remove(root_ / "rgbd_dataset_freiburg1_xyz" / "groundtruth.txt");
  options_.overwrite = true;
  convertTumRgbd(options_);
  EXPECT_FALSE(fs::exists(truth));
}

TEST_F(TumConverter, TheExifOrientationTurnsNothing) {
  makeFolder("rgbd_dataset_freiburg1_xyz");
  const cv::Mat picture(480, 640, CV_8UC3, cv::Scalar(10, 20, 30));
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", picture, jpeg);
  // An APP1 segment right after the start of the image: EXIF, big endian, orientation 6 (turned by a quarter).
  const std::vector<std::uint8_t> exif = {0xff, 0xe1, 0, 34, 'E', 'x', 'i', 'f', 0,    0,    'M', 'M',
                                          0,    42,   0, 0,  0,   8,   0,   1,   0x01, 0x12, 0,   3,
                                          0,    0,    0, 1,  0,   6,   0,   0,   0,    0,    0,   0};
  jpeg.insert(jpeg.begin() + 2, exif.begin(), exif.end());
  ASSERT_EQ(cv::imdecode(jpeg, cv::IMREAD_COLOR).rows, picture.cols) << "the tag is not understood";
  for (int i = 0; i < 4; ++i)
    write("rgbd_dataset_freiburg1_xyz/rgb/" + std::to_string(i) + ".png", std::string(jpeg.begin(), jpeg.end()));
  convertTumRgbd(options_);
  const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
  EXPECT_EQ(sensor.camera.width, 640);
  const auto color = read<sensor_msgs::Image>(sensor.topics.color);
  ASSERT_EQ(color.size(), 4u);
  EXPECT_EQ(color[0]->width, 640u);
}

TEST_F(TumConverter, TheUnitOfDepthIsGuessedAndNamed) {
  makeFolder("room");
  write("room/calibration.txt", "525 525 320 240\n");
  const auto scaleOf = [&](double near, double far, double factor) {
    cv::Mat depth(480, 640, CV_16UC1);
    for (int v = 0; v < depth.rows; ++v)
      depth.row(v).setTo(std::lround((near + (far - near) * v / depth.rows) * 1000) * (factor / 1000));
    for (int i = 0; i < 4; ++i) writeImage("room/depth/" + std::to_string(i) + ".png", depth);
    return [this] {
      options_.overwrite = true;
      const ConversionReport report = convertTumRgbd(options_);
      words_ = report.notes.empty() ? "" : report.notes[0];
      warning_ = report.warnings.empty() ? "" : report.warnings[0];
      return 1 / loadSensorConfig((root_ / "out_sensor.yaml").string()).depth_scale;
    }();
  };
  EXPECT_NEAR(scaleOf(0.5, 2, 1000), 1000, 1e-6);
  EXPECT_NE(words_.find("depth: 1000 units per metre are guessed"), std::string::npos) << words_;
  EXPECT_NEAR(scaleOf(0.5, 2, 5000), 5000, 1e-6);
  EXPECT_NE(words_.find("depth: 5000 units per metre are guessed: the values are multiples of 5"), std::string::npos);
  EXPECT_EQ(warning_, "");
  EXPECT_NEAR(scaleOf(1, 5, 1000), 1000, 1e-6);
  EXPECT_NE(warning_.find("--depth-factor says otherwise"), std::string::npos) << "not certain";
  options_.depth_factor = 2000;
  EXPECT_NEAR(scaleOf(1, 5, 1000), 2000, 1e-6);
  EXPECT_EQ(words_ + warning_, "") << "as given";
}

// Before a textured sphere, around whose middle the camera turns: colour and depth are exact.
TEST_F(TumConverter, TheDelayBetweenPosesAndImagesIsEstimated) {
  constexpr int kColumns = 320, kRows = 240;
  constexpr double kFocal = 250, kRadius = 3, kDelay = 0.037;
  cv::Mat texture(3 * kRows, 3 * kColumns, CV_8UC3);
  cv::RNG random(3);
  random.fill(texture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(texture, texture, {0, 0}, 2.5);
  cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  const auto turn = [](double t) {
    return expSO3(Eigen::Vector3d(0.2 * std::sin(3 * t), 0.25 * std::sin(2.2 * t + 1), 0.1 * std::sin(4 * t)));
  };
  Eigen::Matrix3d K, of_texture;
  K << kFocal, 0, 0.5 * (kColumns - 1), 0, kFocal, 0.5 * (kRows - 1), 0, 0, 1;
  of_texture << kFocal, 0, 1.5 * kColumns, 0, kFocal, 1.5 * kRows, 0, 0, 1;
  cv::Mat depth(kRows, kColumns, CV_16UC1);
  for (int v = 0; v < kRows; ++v)
    for (int u = 0; u < kColumns; ++u)
      depth.at<std::uint16_t>(v, u) = std::uint16_t(5000 * kRadius / (K.inverse() * Eigen::Vector3d(u, v, 1)).norm());
  std::string rgb, depths, truth;
  for (int i = 0; i < 90; ++i) {
    const double t = i / 30.0;
    const Eigen::Matrix3d H = of_texture * turn(t) * K.inverse();
    cv::Mat to_texture(3, 3, CV_64F), image;
    for (int k = 0; k < 9; ++k) to_texture.at<double>(k / 3, k % 3) = H(k / 3, k % 3);
    cv::warpPerspective(texture, image, to_texture, {kColumns, kRows}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
    writeImage("set/rgb/" + std::to_string(i) + ".png", image);
    writeImage("set/depth/" + std::to_string(i) + ".png", depth);
    rgb += formatted("%.6f rgb/%d.png\n", 100 + t, i);
    depths += formatted("%.6f depth/%d.png\n", 100 + t, i);
  }
  for (double t = -0.5; t < 3.5; t += 0.01) {
    const Eigen::Quaterniond q(turn(t - kDelay));
    truth += formatted("%.4f 0 0 0 %.9f %.9f %.9f %.9f\n", 100 + t, q.x(), q.y(), q.z(), q.w());
  }
  write("set/rgb.txt", rgb);
  write("set/depth.txt", depths);
  write("set/groundtruth.txt", truth);
  write("set/calibration.txt", formatted("%g %g %g %g\n", K(0, 0), K(1, 1), K(0, 2), K(1, 2)));
  options_.folder = (root_ / "set").string();
  options_.bag = bag_;
  options_.depth_factor = 5000;
  const ConversionReport report = convertTumRgbd(options_);
  ASSERT_EQ(report.notes.size(), 1u);
  const std::string& note = report.notes[0];
  const auto at = note.find("--time-offset ");
  ASSERT_NE(at, std::string::npos) << note;
  EXPECT_NEAR(std::stod(note.substr(at + 14)), kDelay, 0.001) << note;
}

TEST_F(TumConverter, StampsInNanosecondsAreReadAndOthersNameTheirLine) {
  makeFolder("room");
  write("room/calibration.txt", "525 525 320 240\n");
  std::string rgb, depth;
  for (int i = 0; i < 4; ++i) {
    rgb += std::to_string(1403636579763555584LL + i * 33000000LL) + " rgb/" + std::to_string(i) + ".png\n";
    depth += std::to_string(1403636579763555584LL + i * 33000000LL) + " depth/" + std::to_string(i) + ".png\n";
  }
  write("room/rgb.txt", rgb + rgb.substr(rgb.rfind("1403636")));  // public recordings repeat lines
  write("room/depth.txt", depth);
  write("room/groundtruth.txt", "1403636579763555584 0 0 0 0 0 0 1\n1403636579863555584 0 0 0 0 0 0 1\n");
  write("room/imu.txt", "1403636579763555584 0 0 0 0 9.8 0\n1403636579768555584 0 0 0 0 9.8 0\n");
  convertTumRgbd(options_);
  const auto color = read<sensor_msgs::Image>("/camera/rgb/image_color");
  ASSERT_EQ(color.size(), 4u);
  EXPECT_NEAR(color[2]->header.stamp.toSec(), 1403636579.829555584, 1e-6);
  EXPECT_NEAR(read<sensor_msgs::Imu>("/camera/imu")[1]->header.stamp.toSec(), 1403636579.768555584, 1e-6);
  EXPECT_NEAR(readTum((root_ / "out_truth.tum").string())[1].t, 1403636579.863555584, 1e-6);
  for (const char* file : {"out.bag", "out_sensor.yaml", "out_truth.tum"}) fs::remove(root_ / file);
  write("room/rgb.txt", "-3 rgb/0.png\n1 rgb/1.png\n");
  EXPECT_NE(errorOf([&] { convertTumRgbd(options_); }).find("rgb.txt:1: the stamp is -3 s, expected 0 to 4294967295"),
            std::string::npos);
}

TEST_F(TumConverter, UnknownCameraAndBadRowsAreNamed) {
  makeFolder("kitchen");
  EXPECT_NE(errorOf([&] { convertTumRgbd(options_); }).find("no calibration"), std::string::npos);
  write("kitchen/calibration.txt", "525 525 320 240\n");
  write("kitchen/imu.txt", "1305031102.1 0 0 0 0 9.8 0\n1305031102.1 0 0 0 0 9.8 0\n");
  const std::string error = errorOf([&] { convertTumRgbd(options_); });
  EXPECT_NE(error.find("imu.txt:2: the stamp 1305031102.099999905 does not follow 1305031102.099999905"),
            std::string::npos)
      << error;
  write("kitchen/imu.txt", "1305031102.1 0 0 0 0 9.8 0\n1305031102.11 0.1 0 0 0 9.8 0\n");
  options_.depth_factor = 5000;
  EXPECT_TRUE(convertTumRgbd(options_).warnings.empty());
  EXPECT_EQ(loadSensorConfig((root_ / "out_sensor.yaml").string()).topics.imu, "/camera/imu");
  EXPECT_EQ(read<sensor_msgs::Imu>("/camera/imu").size(), 2u);
}

}  // namespace
}  // namespace vip_slam
