// SPDX-License-Identifier: BSD-3-Clause
// Stray Scanner's recordings on tiny ones: the bag's content, and the errors for unreadable folders.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>

#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "converted_folder.h"
#include "vip_slam_bringup/convert/converters.h"
#include "vip_slam_core/util/formatted.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

class StrayConverter : public test_support::ConvertedFolder {
 protected:
  void makeFolder(int video_frames, double gravity) {
    fs::create_directories(root_ / "rec");
    cv::VideoWriter video((root_ / "rec/rgb.mp4").string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 30,
                          {320, 240});
    ASSERT_TRUE(video.isOpened());
    for (int i = 0; i < video_frames; ++i) video.write(cv::Mat(240, 320, CV_8UC3, cv::Scalar(40 * i, 90, 200)));
    video.release();
    std::string odometry = "timestamp, frame, x, y, z, qx, qy, qz, qw\n",
                imu = "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n";
    for (int i = 0; i < 4; ++i) {
      char line[128], name[32];
      std::snprintf(line, sizeof(line), "%.6f, %06d, 0.0, %f, 0.0, 0.0, 0.0, 0.0, 1.0\n", 100 + i / 30.0, i, 0.1 * i);
      odometry += line;
      std::snprintf(name, sizeof(name), "%06d.png", i);
      cv::Mat depth(24, 32, CV_16UC1, cv::Scalar(1234)), confidence(24, 32, CV_8UC1, cv::Scalar(2));
      confidence.colRange(0, 16).setTo(0);
      writeImage(std::string("rec/depth/") + name, depth);
      writeImage(std::string("rec/confidence/") + name, confidence);
    }
    for (int i = 0; i < 20; ++i) {
      char line[128];
      std::snprintf(line, sizeof(line), "%.6f, 0.0, %f, 0.0, 0.01, 0.02, 0.03\n", 100 + 0.01 * i, -gravity);
      imu += line;
    }
    write("rec/odometry.csv", odometry);
    write("rec/imu.csv", imu);
    write("rec/camera_matrix.csv", "250.0, 0.0, 159.5\n0.0, 250.0, 119.5\n0.0, 0.0, 1.0\n");
    options_.folder = (root_ / "rec").string();
    options_.bag = bag_;
    options_.width = 160;
  }
  StrayOptions options_;
};

TEST_F(StrayConverter, ColourDepthAndSpecificForce) {
  for (const double gravity : {1.0, 9.81}) {
    makeFolder(4, gravity);
    options_.overwrite = true;
    const ConversionReport report = convertStray(options_);
    EXPECT_TRUE(report.warnings.empty());
    const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
    const auto imu = read<sensor_msgs::Imu>(sensor.topics.imu);
    ASSERT_EQ(imu.size(), 20u);
    EXPECT_NEAR(imu[0]->linear_acceleration.y, 9.81, 1e-3);  // upright at rest: along +y
    // At rest the specific force points up: against the image's y in a phone turned to landscape. Here the phone is
    // upright, so up is the image's -x.
    const Eigen::Vector3d up_C = sensor.T_imu_cam.R().transpose() * Eigen::Vector3d(0, 1, 0);
    EXPECT_NEAR(up_C.x(), -1, 1e-12);

    const auto color = read<sensor_msgs::CompressedImage>(sensor.topics.color);
    ASSERT_EQ(color.size(), 4u);
    const cv::Mat image = cv::imdecode(color[3]->data, cv::IMREAD_COLOR);
    EXPECT_EQ(image.cols, 160);
    EXPECT_NEAR(image.at<cv::Vec3b>(60, 80)[0], 120, 12);  // must be the fourth frame
    const auto depth = read<sensor_msgs::CompressedImage>(sensor.topics.depth);
    ASSERT_EQ(depth.size(), 4u);
    const cv::Mat z = cv::imdecode(depth[0]->data, cv::IMREAD_UNCHANGED);
    ASSERT_EQ(z.type(), CV_16UC1);
    ASSERT_EQ(z.size(), image.size());
    EXPECT_EQ(z.at<std::uint16_t>(60, 20), 0);  // low confidence
    EXPECT_EQ(z.at<std::uint16_t>(60, 140), 1234);
    const auto info = read<sensor_msgs::CameraInfo>(sensor.topics.color_info);
    EXPECT_NEAR(info[0]->K[0], 125, 1e-9);
    // ARKit's up is y, ours is z.
    const Trajectory truth = readTum((root_ / "out_truth.tum").string());
    EXPECT_NEAR(truth.back().T_W_B.t().z() - truth.front().T_W_B.t().z(), 0.3, 1e-6);
  }
}

/// Tells players to turn the video of an MP4 file by a quarter: the matrix of its track header.
void setRotateFlag(const fs::path& path) {
  std::string bytes;
  {
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  const auto header = bytes.find("tkhd");
  ASSERT_NE(header, std::string::npos);
  ASSERT_EQ(bytes[header + 4], 0) << "another version of the track header";
  const std::int32_t one = 1 << 16, matrix[9] = {0, one, 0, -one, 0, 0, 240 * one, 0, 1 << 30};
  for (int i = 0; i < 9; ++i)
    for (int b = 0; b < 4; ++b)
      bytes[header + 44 + 4 * i + b] = static_cast<char>(static_cast<std::uint32_t>(matrix[i]) >> (24 - 8 * b));
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST_F(StrayConverter, AVideoWithARotateFlagIsTakenAsItIsStored) {
  makeFolder(4, 1.0);
  setRotateFlag(root_ / "rec/rgb.mp4");
  cv::Mat turned;
  ASSERT_TRUE(cv::VideoCapture((root_ / "rec/rgb.mp4").string()).read(turned));
  if (turned.size() != cv::Size(240, 320)) GTEST_SKIP() << "this OpenCV does not know the flag";
  const ConversionReport report = convertStray(options_);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("tells players to turn it by"), std::string::npos) << report.warnings[0];
  const auto color = read<sensor_msgs::CompressedImage>("/phone/color/image_raw/compressed");
  ASSERT_EQ(color.size(), 4u);
  EXPECT_EQ(cv::imdecode(color[3]->data, cv::IMREAD_COLOR).size(), cv::Size(160, 120));
}

TEST_F(StrayConverter, AVideoOfAnotherShapeOrSizeIsNamed) {
  makeFolder(4, 1.0);
  write("rec/camera_matrix.csv", "500.0, 0.0, 319.5\n0.0, 500.0, 239.5\n0.0, 0.0, 1.0\n");
  const std::string resized = errorOf([&] { convertStray(options_); });
  EXPECT_NE(resized.find("pictures of 320x240, but the intrinsics (principal point 320, 240) are for pictures of about "
                         "640x480: resized by hand?"),
            std::string::npos)
      << resized;
  makeFolder(4, 1.0);
  for (int i = 0; i < 4; ++i) writeImage(formatted("rec/depth/%06d.png", i), cv::Mat(32, 24, CV_16UC1, cv::Scalar(9)));
  const std::string turned = errorOf([&] { convertStray(options_); });
  EXPECT_NE(turned.find("pictures of 320x240 have another shape than the depth images of 24x32"), std::string::npos)
      << turned;
}

TEST_F(StrayConverter, ImuRowsOutOfOrderAreSortedAndCounted) {
  makeFolder(4, 1.0);
  std::string imu = "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n";
  for (const double t : {100.00, 100.02, 100.01, 100.03, 100.03, 100.04})
    imu += formatted("%.6f, 0.0, -1.0, 0.0, %f, 0.02, 0.03\n", t, t - 100);
  write("rec/imu.csv", imu);
  const ConversionReport report = convertStray(options_);
  ASSERT_EQ(report.warnings.size(), 2u);
  EXPECT_NE(report.warnings[0].find("imu.csv: 1 of 6 rows come late and are sorted"), std::string::npos);
  EXPECT_NE(report.warnings[1].find("imu.csv: 1 of 6 rows repeat a stamp and are left out"), std::string::npos);
  const auto samples = read<sensor_msgs::Imu>("/phone/imu");
  ASSERT_EQ(samples.size(), 5u);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(samples[i]->angular_velocity.x, 0.01 * i, 1e-6);
}

TEST_F(StrayConverter, FocalLengthsDifferFromRowToRow) {
  makeFolder(4, 1.0);
  // A bright square at about the same bearing in all pictures, while the focal length grows.
  cv::VideoWriter video((root_ / "rec/rgb.mp4").string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 30, {320, 240});
  std::string odometry = "timestamp, frame, x, y, z, qx, qy, qz, qw, fx, fy, cx, cy\n";
  std::vector<Eigen::Vector2d> bearings;
  for (int i = 0; i < 4; ++i) {
    const double f = 250 + 5 * i;
    cv::Mat picture(240, 320, CV_8UC3, cv::Scalar(20, 20, 20));
    const int u = static_cast<int>(std::lround(159.5 + 0.4 * f)), v = static_cast<int>(std::lround(119.5 - 0.2 * f));
    picture(cv::Rect(u - 8, v - 8, 17, 17)).setTo(cv::Scalar(230, 230, 230));
    video.write(picture);
    bearings.emplace_back((u - 159.5) / f, (v - 119.5) / f);
    odometry += formatted("%.6f, %06d, 0, 0, 0, 0, 0, 0, 1, %f, %f, 159.5, 119.5\n", 100 + i / 30.0, i, f, f);
  }
  video.release();
  write("rec/odometry.csv", odometry);
  options_.width = 320;
  convertStray(options_);
  const auto infos = read<sensor_msgs::CameraInfo>("/phone/color/camera_info");
  const auto pictures = read<sensor_msgs::CompressedImage>("/phone/color/image_raw/compressed");
  ASSERT_EQ(infos.size(), 4u);
  ASSERT_EQ(pictures.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(infos[i]->K[0], 265, 1e-6);  // the longest
    const cv::Moments m = cv::moments(cv::imdecode(pictures[i]->data, cv::IMREAD_GRAYSCALE) > 128, true);
    EXPECT_NEAR(m.m10 / m.m00, 159.5 + 265 * bearings[i].x(), 0.6) << i;
    EXPECT_NEAR(m.m01 / m.m00, 119.5 + 265 * bearings[i].y(), 0.6) << i;
  }
}

TEST_F(StrayConverter, OneHiddenFrameIsForgivenAShortVideoIsNot) {
  makeFolder(3, 1.0);
  const ConversionReport report = convertStray(options_);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_EQ(read<sensor_msgs::CompressedImage>("/phone/color/image_raw/compressed").size(), 3u);
  fs::remove(bag_);
  fs::remove(root_ / "out_sensor.yaml");
  fs::remove(root_ / "out_truth.tum");
  makeFolder(1, 1.0);
  EXPECT_NE(errorOf([&] { convertStray(options_); }).find("1 frames for 4 rows"), std::string::npos);
  makeFolder(4, 5.0);
  EXPECT_NE(errorOf([&] { convertStray(options_); }).find("median acceleration"), std::string::npos);
}

}  // namespace
}  // namespace vip_slam
