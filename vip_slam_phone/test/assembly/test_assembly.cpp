// SPDX-License-Identifier: BSD-3-Clause
// One clock, one camera, the middle row's mid-exposure.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_phone/assembly/assembler.h"

namespace vip_slam::phone {
namespace {

TEST(PhoneClock, FollowsADriftWithoutJumpsThroughABusyNetwork) {
  ClockOffset clock;
  std::mt19937 random(3);
  std::exponential_distribution<double> late(1 / 0.004);
  const double ahead = 86400, drift = 20e-6;
  double worst = 0, step = 0, last = 0;
  for (int i = 0; i < 60000; ++i) {
    const double local = 1e6 + 0.01 * i, remote = local * (1 + drift) + ahead;
    clock.add(remote, local + 0.001 + late(random));
    if (!clock.ready()) continue;
    const double error = clock.toLocal(remote) - local - 0.001;
    if (i > 3000) worst = std::max(worst, std::abs(error));
    if (last > 0) step = std::max(step, std::abs(error - last));
    last = error;
  }
  EXPECT_LT(worst, 0.0005);
  EXPECT_LT(step, 0.0002);
}

class Assembly : public ::testing::Test {
 protected:
  static constexpr double kAhead = 86400;  ///< of the phone's clock, s

  void imu(double t) {
    Record record;
    record.sequence = sequence_++;
    record.unix_time = t + kAhead;
    record.what = ImuRecord{Eigen::Vector3d(t, 0, 0), Eigen::Vector3d(0, 9.8, 0)};
    assembler_.addRecord(record, t, &out_);
  }
  void camera(double t, double focal, double exposure) {
    Record record;
    record.sequence = sequence_++;
    record.unix_time = t + kAhead;
    IntrinsicsRecord what;
    what.camera.width = 960;
    what.camera.height = 720;
    what.camera.fx = what.camera.fy = focal;
    what.camera.cx = 480;
    what.camera.cy = 360;
    what.exposure = exposure;
    record.what = what;
    assembler_.addRecord(record, t, &out_);
  }
  void image(double t) { assembler_.addColor(t + kAhead, cv::Mat(720, 960, CV_8UC3, cv::Scalar(1, 2, 3)), &out_); }
  void depth(double t) {
    DepthFrame frame;
    frame.unix_time = t + kAhead;
    frame.metres = cv::Mat(192, 256, CV_32FC1, cv::Scalar(2));
    assembler_.addDepth(frame, &out_);
  }

  std::uint16_t sequence_ = 65500;  // wraps on the way
  Assembler assembler_{480};
  Assembled out_;
};

TEST_F(Assembly, ImagesHaveOneCameraAndTheirOwnExposure) {
  for (int i = 0; i < 300; ++i) {
    const double t = 1000 + 0.01 * i;
    imu(t);
    if (i % 5 || i < 150) continue;
    // The camera before the image, or after it.
    if (i % 10 == 0) camera(t, 800 + i / 10, 0.001 * (1 + i % 4));
    image(t);
    depth(t);
    if (i % 10 != 0) camera(t, 800 + i / 10, 0.001 * (1 + i % 4));
  }
  ASSERT_EQ(out_.color.size(), 30u);
  ASSERT_EQ(out_.depth.size(), 30u);
  EXPECT_EQ(assembler_.counts().imu_lost, 0u);
  for (std::size_t k = 0; k < 30; ++k) {
    const int i = 150 + 5 * static_cast<int>(k);
    EXPECT_NEAR(out_.color[k].t, 1000 + 0.01 * i - 0.0005 * (1 + i % 4), 1e-4);
    EXPECT_EQ(out_.depth[k].t, out_.color[k].t);
    EXPECT_EQ(out_.color[k].image.size(), cv::Size(480, 360));
    EXPECT_EQ(out_.depth[k].image.size(), cv::Size(480, 360));
    EXPECT_EQ(out_.color[k].camera.fx, out_.color[0].camera.fx);
  }
  EXPECT_NEAR(out_.color[0].camera.fx, 815 * 0.5, 1e-9);
  EXPECT_NEAR(assembler_.breathing(), 829. / 815, 1e-6);
}

TEST_F(Assembly, WithoutItsOwnCameraTheLastOneServes) {
  for (int i = 0; i < 200; ++i) imu(1000 + 0.01 * i);
  camera(1001.99, 800, 0);
  image(1002.05);
  EXPECT_TRUE(out_.color.empty()) << "its own may still come";
  for (int i = 200; i < 240; ++i) imu(1000 + 0.01 * i);
  ASSERT_EQ(out_.color.size(), 1u);
  EXPECT_NEAR(out_.color[0].t, 1002.05, 1e-4);
}

TEST_F(Assembly, UprightImagesAndGapsAreCounted) {
  for (int i = 0; i < 200; ++i) imu(1000 + 0.01 * i);
  sequence_ += 7;
  imu(1002.1);
  EXPECT_EQ(assembler_.counts().imu_lost, 7u);
  assembler_.addColor(1002.1 + kAhead, cv::Mat(960, 720, CV_8UC3), &out_);
  EXPECT_EQ(assembler_.counts().portrait, 1u);
  EXPECT_TRUE(out_.color.empty());
}

TEST_F(Assembly, GyroscopeAndAccelerometerApartAreUnited) {
  for (int i = 0; i < 200; ++i) imu(1000 + 0.01 * i);
  out_ = {};
  for (int i = 200; i < 260; ++i) {
    Record record;
    record.sequence = sequence_++;
    record.unix_time = 1000 + 0.01 * i + kAhead;
    record.what = i % 2 ? ImuRecord{{}, Eigen::Vector3d(0, 0, i)} : ImuRecord{Eigen::Vector3d(i, 0, 0), {}};
    assembler_.addRecord(record, 1000 + 0.01 * i, &out_);
  }
  ASSERT_GT(out_.imu.size(), 25u);
  for (const ImuSample& sample : out_.imu) EXPECT_NEAR(sample.accel.z(), sample.gyro.x(), 1e-4);
}

}  // namespace
}  // namespace vip_slam::phone
