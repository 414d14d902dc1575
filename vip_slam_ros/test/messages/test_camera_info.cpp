// SPDX-License-Identifier: BSD-3-Clause
// Intrinsics to camera_info and back; fields that drivers leave out are handled, unusable ones are named.
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "vip_slam_ros/camera_info.h"

namespace vip_slam {
namespace {

TEST(CameraInfo, BothWays) {
  CameraIntrinsics intrinsics;
  intrinsics.width = 640;
  intrinsics.height = 480;
  intrinsics.fx = 600;
  intrinsics.fy = 601;
  intrinsics.cx = 320.5;
  intrinsics.cy = 240.25;
  intrinsics.model = DistortionModel::kRadTan;
  intrinsics.distortion = {0.1, -0.05, 0.001, 0.002, 0.01};
  const CameraIntrinsics back = intrinsicsFromCameraInfo(toCameraInfo(intrinsics));
  EXPECT_EQ(back.width, 640);
  EXPECT_EQ(back.height, 480);
  EXPECT_EQ(back.fx, 600);
  EXPECT_EQ(back.fy, 601);
  EXPECT_EQ(back.cx, 320.5);
  EXPECT_EQ(back.cy, 240.25);
  EXPECT_EQ(back.model, DistortionModel::kRadTan);
  EXPECT_EQ(back.distortion, intrinsics.distortion);
}

TEST(CameraInfo, WhereKIsZeroPIsUsedAndSaid) {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  EXPECT_THROW(intrinsicsFromCameraInfo(info), std::invalid_argument);
  EXPECT_EQ(cameraInfoNote(info), "");
  info.P = {500, 0, 321, 0, 0, 501, 239, 0, 0, 0, 1, 0};
  const CameraIntrinsics camera = intrinsicsFromCameraInfo(info, "/camera/image_raw");
  EXPECT_EQ(camera.fx, 500);
  EXPECT_EQ(camera.cx, 321);
  EXPECT_EQ(camera.fy, 501);
  EXPECT_EQ(camera.cy, 239);
  EXPECT_EQ(cameraInfoNote(info), "K is zero, P is used instead");
  info.distortion_model = "plumb_bob";
  info.D = {0.1, 0, 0, 0, 0};
  EXPECT_EQ(intrinsicsFromCameraInfo(info).distortion.front(), 0.1);
  EXPECT_NE(cameraInfoNote(info).find("though D has a distortion"), std::string::npos);
  info.K = {600, 0, 320, 0, 600, 240, 0, 0, 1};
  EXPECT_EQ(intrinsicsFromCameraInfo(info).fx, 600);
  EXPECT_EQ(cameraInfoNote(info), "");
}

TEST(CameraInfo, ZeroCoefficientsLeaveAFisheyeAFisheye) {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  info.K = {300, 0, 320, 0, 300, 240, 0, 0, 1};
  const auto model = [&](const std::string& name, std::size_t coefficients) {
    info.distortion_model = name;
    info.D.assign(coefficients, 0.0);
    return intrinsicsFromCameraInfo(info).model;
  };
  EXPECT_EQ(model("equidistant", 4), DistortionModel::kEquidistant);
  EXPECT_EQ(model("fisheye", 4), DistortionModel::kEquidistant);
  EXPECT_EQ(model("fisheye", 5), DistortionModel::kEquidistant);
  EXPECT_EQ(model("equidistant", 0), DistortionModel::kNone);
  EXPECT_EQ(model("plumb_bob", 5), DistortionModel::kNone);
  EXPECT_EQ(model("rational_polynomial", 8), DistortionModel::kNone);
  EXPECT_EQ(model("", 0), DistortionModel::kNone);

  CameraIntrinsics fisheye;
  fisheye.width = 640;
  fisheye.height = 480;
  fisheye.fx = fisheye.fy = 300;
  fisheye.cx = 320;
  fisheye.cy = 240;
  fisheye.model = DistortionModel::kEquidistant;
  for (const std::vector<double>& distortion : {std::vector<double>{}, std::vector<double>(4, 0.0)}) {
    fisheye.distortion.assign(distortion.begin(), distortion.end());
    EXPECT_EQ(intrinsicsFromCameraInfo(toCameraInfo(fisheye)).model, DistortionModel::kEquidistant);
  }
}

// image_proc publishes one camera_info, that of the lens, for image_raw, image_rect and image_rect_color alike.
TEST(CameraInfo, OfRectifiedImagesIsTheProjection) {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  info.distortion_model = "plumb_bob";
  info.D = {0.1, -0.2, 0.001, 0.002, 0};
  info.K = {600, 0, 321, 0, 601, 241, 0, 0, 1};
  info.P = {580, 0, 322, 0, 0, 581, 242, 0, 0, 0, 1, 0};
  for (const char* topic : {"/camera/rgb/image_rect_color", "/camera/rgb/image_rect/compressed"}) {
    const CameraIntrinsics rectified = intrinsicsFromCameraInfo(info, topic);
    EXPECT_EQ(rectified.model, DistortionModel::kNone);
    EXPECT_TRUE(rectified.distortion.empty());
    EXPECT_EQ(Eigen::Vector4d(rectified.fx, rectified.fy, rectified.cx, rectified.cy),
              Eigen::Vector4d(580, 581, 322, 242));
  }
  const CameraIntrinsics raw = intrinsicsFromCameraInfo(info, "/camera/rgb/image_raw");
  EXPECT_EQ(raw.model, DistortionModel::kRadTan);
  EXPECT_EQ(raw.fx, 600);
  info.P = {};
  const CameraIntrinsics without = intrinsicsFromCameraInfo(info, "/camera/rgb/image_rect");
  EXPECT_EQ(without.model, DistortionModel::kNone);
  EXPECT_EQ(without.fx, 600);
  info.K = {};
  EXPECT_THROW(intrinsicsFromCameraInfo(info, "/camera/rgb/image_rect"), std::invalid_argument);
}

TEST(CameraInfo, ZerosBehindTheCoefficientsSayNothing) {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  info.K = {300, 0, 320, 0, 300, 240, 0, 0, 1};
  info.distortion_model = "equidistant";
  info.D = {0.1, 0.2, 0.3, 0.4, 0};
  EXPECT_EQ(intrinsicsFromCameraInfo(info).distortion, (std::vector<double>{0.1, 0.2, 0.3, 0.4}));
  info.distortion_model = "rational_polynomial";
  info.D = {1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0, 0, 0};
  EXPECT_EQ(intrinsicsFromCameraInfo(info).distortion, (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8}));
  info.D.back() = 0.1;  // tilted sensor: not supported
  EXPECT_THROW(intrinsicsFromCameraInfo(info), std::invalid_argument);
  info.distortion_model = "";
  info.D = {0.1, 0.2, 0, 0, 0.3};
  EXPECT_EQ(intrinsicsFromCameraInfo(info).model, DistortionModel::kRadTan);
}

TEST(CameraInfo, APartOfTheSensorAndBinnedPixels) {
  sensor_msgs::CameraInfo info;
  info.width = 1280;
  info.height = 960;
  info.K = {1200, 0, 639.5, 0, 1200, 479.5, 0, 0, 1};
  info.binning_x = info.binning_y = 2;
  CameraIntrinsics binned = intrinsicsFromCameraInfo(info);
  EXPECT_EQ(binned.width, 640);
  EXPECT_EQ(binned.fx, 600);
  EXPECT_EQ(binned.cx, 319.5);
  info.roi.x_offset = 320;
  info.roi.y_offset = 120;
  info.roi.width = 640;
  info.roi.height = 720;
  info.binning_x = info.binning_y = 0;
  const CameraIntrinsics part = intrinsicsFromCameraInfo(info);
  EXPECT_EQ(part.width, 640);
  EXPECT_EQ(part.height, 720);
  EXPECT_EQ(part.fx, 1200);
  EXPECT_EQ(part.cx, 319.5);
  EXPECT_EQ(part.cy, 359.5);
  EXPECT_EQ(cameraInfoNote(info), "");
}

TEST(CameraInfo, AKThatIsOfTheImagesAlreadyIsTakenSo) {
  sensor_msgs::CameraInfo binned;
  binned.width = 1280;
  binned.height = 960;
  binned.K = {600, 0, 318.2, 0, 600, 243.5, 0, 0, 1};
  binned.binning_x = binned.binning_y = 2;
  sensor_msgs::CameraInfo part = binned;
  part.K = {1200, 0, 319.5, 0, 1200, 359.5, 0, 0, 1};
  part.binning_x = part.binning_y = 0;
  part.roi.x_offset = 320;
  part.roi.y_offset = 120;
  part.roi.width = 640;
  part.roi.height = 720;
  for (const sensor_msgs::CameraInfo& info : {binned, part}) {
    const CameraIntrinsics camera = intrinsicsFromCameraInfo(info);
    EXPECT_EQ(camera.width, 640);
    EXPECT_EQ(camera.fx, info.K[0]);
    EXPECT_EQ(camera.cx, info.K[2]);
    EXPECT_EQ(camera.cy, info.K[5]);
    EXPECT_NE(cameraInfoNote(info).find("K is taken for that of the images already"), std::string::npos);
  }
  // A lens a little beside the middle, and a crop about which the principal point says nothing, are taken as given.
  part.K = {1200, 0, 680, 0, 1200, 450, 0, 0, 1};
  EXPECT_EQ(intrinsicsFromCameraInfo(part).cx, 360);
  part.roi.x_offset = 40;
  part.roi.y_offset = 20;
  EXPECT_EQ(intrinsicsFromCameraInfo(part).cx, 640);
}

TEST(CameraInfo, UnusableIsNamed) {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  try {
    intrinsicsFromCameraInfo(info);
    FAIL() << "an uncalibrated camera was taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("fx"), std::string::npos) << error.what();
  }
  info.K = {600, 0, 320, 0, 600, 240, 0, 0, 1};
  info.distortion_model = "magic";
  info.D = {0.1, 0, 0, 0, 0};
  EXPECT_THROW(intrinsicsFromCameraInfo(info), std::invalid_argument);
}

}  // namespace
}  // namespace vip_slam
