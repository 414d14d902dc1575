// SPDX-License-Identifier: BSD-3-Clause
// Sources of the calibration, and how long the nodelet waits for them.
#include <gtest/gtest.h>

#include "calibration_source.h"

namespace vip_slam {
namespace {

SensorConfig sensor() {
  SensorConfig config;
  config.topics.color = "/camera/color";
  config.topics.imu = "/camera/imu";
  config.intrinsics_from_camera_info = false;
  return config;
}

void connect(tf2::BufferCore& tf, const std::string& parent, const std::string& child, double x) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = parent;
  transform.child_frame_id = child;
  transform.transform.translation.x = x;
  transform.transform.rotation.w = 1;
  tf.setTransform(transform, "test", true);
}

class CalibrationSourceTest : public ::testing::Test {
 protected:
  FrontEndNodeOptions options_;
  tf2::BufferCore tf_;
};

TEST_F(CalibrationSourceTest, TheMissingTopicIsNamedForUnitedAndSplitStreams) {
  SensorConfig united = sensor(), split = sensor();
  united.topics.imu = "/camera/imu";
  split.topics.imu.clear();
  split.topics.gyro = "/camera/gyro";
  for (const SensorConfig& each : {united, split}) {
    CalibrationSource source(each, options_, tf_);
    EXPECT_FALSE(source.resolve(0));
    const std::string topic = each.topics.imu + each.topics.gyro;  // one of them is empty
    EXPECT_NE(source.waitingFor().find("topic " + topic + " yet"), std::string::npos) << source.waitingFor();
  }
}

TEST_F(CalibrationSourceTest, ACameraThatStartsLateStillGetsItsExtrinsicsFromTf) {
  connect(tf_, "base_link", "imu", 0.1);
  connect(tf_, "base_link", "camera", 0.3);
  CalibrationSource source(sensor(), options_, tf_);
  EXPECT_FALSE(source.resolve(0));
  EXPECT_NE(source.waitingFor().find("IMU"), std::string::npos);
  source.addImuFrame("imu");
  for (double t = 0; t < 10; t += 0.5) EXPECT_FALSE(source.resolve(t)) << t;
  EXPECT_NE(source.waitingFor().find("/camera/color"), std::string::npos) << source.waitingFor();
  source.addColorFrame("camera");
  const auto found = source.resolve(10);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->T_imu_cam.t().x(), 0.2, 1e-12);
  EXPECT_NEAR(found->T_base_imu.t().x(), 0.1, 1e-12);
  EXPECT_FALSE(source.tfIsIncomplete());
  EXPECT_EQ(source.extrinsicsOrigin(), "T_imu_cam: from tf; T_base_imu: from tf");
}

TEST_F(CalibrationSourceTest, WithoutAnImuTheCameraAloneIsWaitedFor) {
  connect(tf_, "base_link", "camera", 0.3);
  SensorConfig alone = sensor();
  alone.topics.imu.clear();
  alone.T_imu_cam.t().x() = 0.1;  // of a body that the file puts elsewhere
  CalibrationSource source(alone, options_, tf_);
  EXPECT_FALSE(source.resolve(0));
  EXPECT_NE(source.waitingFor().find("/camera/color"), std::string::npos) << source.waitingFor();
  source.addColorFrame("camera");
  const auto found = source.resolve(0);
  ASSERT_TRUE(found) << source.waitingFor();
  EXPECT_DOUBLE_EQ(found->T_imu_cam.t().x(), 0.1);
  EXPECT_NEAR(found->T_base_imu.t().x(), 0.2, 1e-12);
  EXPECT_FALSE(source.tfIsIncomplete());
  EXPECT_EQ(source.extrinsicsOrigin(), "T_imu_cam: the sensor file's, there is no IMU; T_base_imu: from tf");

  const tf2::BufferCore empty;
  CalibrationSource unconnected(alone, options_, empty);
  unconnected.addColorFrame("camera");
  EXPECT_FALSE(unconnected.resolve(0));
  EXPECT_NE(unconnected.waitingFor().find("'camera' to 'base_link'"), std::string::npos) << unconnected.waitingFor();
  EXPECT_TRUE(unconnected.resolve(2 * options_.tf_patience));
}

// tf answers with the identity for any frame and itself, also for one that it never heard of.
TEST_F(CalibrationSourceTest, OneFrameForImageAndImuSaysNothingOfTheirPlaces) {
  connect(tf_, "base_link", "camera", 0.3);
  SensorConfig given = sensor();
  given.T_imu_cam.t().x() = 0.7;
  CalibrationSource source(given, options_, tf_);
  source.addImuFrame("/camera");
  source.addColorFrame("camera");
  EXPECT_FALSE(source.resolve(0));
  EXPECT_NE(source.waitingFor().find("the same frame"), std::string::npos) << source.waitingFor();
  const auto found = source.resolve(2 * options_.tf_patience);
  ASSERT_TRUE(found);
  EXPECT_DOUBLE_EQ(found->T_imu_cam.t().x(), 0.7);
  EXPECT_DOUBLE_EQ(found->T_base_imu.t().x(), 0.3);
  options_.extrinsics = "tf";
  CalibrationSource demanding(given, options_, tf_);
  demanding.addImuFrame("camera");
  demanding.addColorFrame("camera");
  EXPECT_FALSE(demanding.resolve(0));
  EXPECT_FALSE(demanding.resolve(100));
}

TEST_F(CalibrationSourceTest, ACameraFarFromItsImuIsAnErrorWhereverItIsSaid) {
  connect(tf_, "base_link", "imu", 0.1);
  connect(tf_, "base_link", "camera", 25.1);  // millimetres
  const auto resolve = [&](const SensorConfig& given, std::string* why) {
    CalibrationSource source(given, options_, tf_);
    source.addImuFrame("imu");
    source.addColorFrame("camera");
    const bool resolved = bool(source.resolve(100));
    *why = source.waitingFor();
    return resolved;
  };
  std::string why;
  EXPECT_FALSE(resolve(sensor(), &why));
  EXPECT_NE(why.find("the camera is 25.00 m from the IMU, expected 1 m at most (max_lever_arm)"), std::string::npos)
      << why;
  options_.input.max_lever_arm = 30;
  EXPECT_TRUE(resolve(sensor(), &why));
  options_ = FrontEndNodeOptions();
  options_.extrinsics = "config";
  SensorConfig far = sensor();
  EXPECT_TRUE(resolve(far, &why));
  far.T_imu_cam.t().x() = 1.2;
  EXPECT_FALSE(resolve(far, &why));
  EXPECT_NE(why.find("the camera is 1.20 m from the IMU"), std::string::npos) << why;
}

TEST_F(CalibrationSourceTest, TfMayComeALittleAfterTheFrames) {
  CalibrationSource source(sensor(), options_, tf_);
  source.addImuFrame("imu");
  source.addColorFrame("camera");
  EXPECT_FALSE(source.resolve(100));
  EXPECT_NE(source.waitingFor().find("'camera' to 'imu'"), std::string::npos) << source.waitingFor();
  connect(tf_, "base_link", "imu", 0.1);
  connect(tf_, "base_link", "camera", 0.3);
  EXPECT_TRUE(source.resolve(100 + 0.5 * options_.tf_patience));
}

TEST_F(CalibrationSourceTest, WithoutTfTheConfigurationIsTakenInTheEndUnlessTfIsDemanded) {
  SensorConfig config = sensor();
  config.T_imu_cam = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 0.05));
  for (const std::string from : {"auto", "tf", "config"}) {
    options_.extrinsics = from;
    CalibrationSource source(config, options_, tf_);
    source.addImuFrame("imu");
    EXPECT_EQ(bool(source.resolve(50)), from == "config") << from;  // needs no image
    source.addColorFrame("camera");
    EXPECT_EQ(bool(source.resolve(50)), from == "config") << from;
    // Time jumps back, as when a bag loops.
    EXPECT_EQ(bool(source.resolve(1)), from == "config") << from;
    EXPECT_EQ(bool(source.resolve(2)), from == "config") << from;
    const auto late = source.resolve(1 + options_.tf_patience + 0.1);
    EXPECT_EQ(bool(late), from != "tf") << from;
    if (late) EXPECT_EQ(late->T_imu_cam.t().z(), 0.05);
    EXPECT_EQ(source.tfIsIncomplete(), from == "auto") << from;
    if (from == "auto") {
      const std::string origin = source.extrinsicsOrigin();
      EXPECT_NE(origin.find("T_base_imu: the sensor file's, tf does not connect 'imu' to 'base_link'"),
                std::string::npos)
          << origin;
    }
  }
}

}  // namespace
}  // namespace vip_slam
