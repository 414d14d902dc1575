// SPDX-License-Identifier: BSD-3-Clause
// check_bag against bags with one fault each: the fault is found, named, and nothing else is called an error.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "driver_bag.h"
#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/recorder.h"
#include "vip_slam_core/geometry/angle.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

using test_support::DriverBagOptions;

class CheckBag : public testing::Test {
 protected:
  void SetUp() override {
    path_ = (fs::temp_directory_path() / ("vip_slam_check_" + std::to_string(::getpid()) + ".bag")).string();
    options_.sensor = expected_ = loadSensorConfig(CONFIG_DIR "/sensors/d435i.yaml");
    options_.width = 320;  // small images: these tests are about everything but the images
    options_.height = 240;
    options_.moving = 2.4;
  }
  void TearDown() override { fs::remove(path_); }

  Findings check() {
    test_support::writeDriverBag(path_, options_);
    return checkAll(recordBag(path_, expected_, 60));
  }
  /// Expects a finding of that severity about `about` whose text contains `words`.
  static void expectFound(const Findings& findings, Severity severity, const std::string& about,
                          const std::string& words) {
    for (const Finding& f : findings)
      if (f.severity == severity && f.about == about && (f.text + " " + f.advice).find(words) != std::string::npos)
        return;
    ADD_FAILURE() << "no such finding: " << about << ": " << words << "\n" << toText(findings, false);
  }
  static void expectNoErrorBut(const Findings& findings, const std::string& about) {
    for (const Finding& f : findings)
      EXPECT_TRUE(f.severity != Severity::kError || f.about == about) << f.about << ": " << f.text;
  }

  std::string path_;
  DriverBagOptions options_;
  SensorConfig expected_;
};

TEST_F(CheckBag, AGoodBagIsReady) {
  const Findings findings = check();
  EXPECT_LT(static_cast<int>(worst(findings)), static_cast<int>(Severity::kWarning)) << toText(findings, false);
  EXPECT_NE(toText(findings, false).find("Ready.\n"), std::string::npos);
}

TEST_F(CheckBag, CameraInfosThatAreEmptyAtFirstAreWaitedOver) {
  options_.empty_infos = 6;
  const Findings findings = check();
  EXPECT_LT(static_cast<int>(worst(findings)), static_cast<int>(Severity::kWarning)) << toText(findings, false);
}

TEST_F(CheckBag, ASecondCameraOnTheSameTopicsIsTheOneCause) {
  options_.second_camera = true;
  const Findings findings = check();
  expectFound(findings, Severity::kWarning, "colour image", "two drivers under one name");
  expectFound(findings, Severity::kWarning, "depth image", "'back_camera_color_optical_frame'");
  for (const Finding& f : findings)
    EXPECT_TRUE(f.severity < Severity::kWarning || f.text.find("back_") != std::string::npos)
        << f.about << ": " << f.text;
}

TEST_F(CheckBag, AMaskOfAnotherSizeIsNamed) {
  expected_.mask_file = "/rig/bumper.png";
  expected_.mask = cv::Mat(240, 320, CV_8U, cv::Scalar(255));
  expected_.mask.rowRange(180, 240) = 0;
  expectFound(check(), Severity::kGood, "mask", "75 %");
  expected_.mask = cv::Mat(480, 640, CV_8U, cv::Scalar(255));
  const Findings findings = check();
  expectFound(findings, Severity::kError, "mask", "/rig/bumper.png is 640x480, the colour image is 320x240");
  expectNoErrorBut(findings, "mask");
}

TEST_F(CheckBag, WrongTopicIsNamedWithItsLikes) {
  options_.renamed["/camera/color/image_raw"] = "/cam/rgb";
  const Findings findings = check();
  expectFound(findings, Severity::kError, "colour image", "/cam/rgb");
  expectNoErrorBut(findings, "colour image");
  EXPECT_NE(toText(findings, false).find("Not ready"), std::string::npos);
}

TEST_F(CheckBag, MissingAndEmptyCalibration) {
  options_.renamed["/camera/color/camera_info"] = "";
  expectFound(check(), Severity::kError, "colour camera_info", "is not there");
  options_.renamed.clear();
  options_.calibrated = false;
  expectFound(check(), Severity::kError, "colour camera_info", "calibrate the camera");
}

TEST_F(CheckBag, DepthOfAnotherSizeUnitOrTime) {
  options_.depth_divisor = 2;
  expectFound(check(), Severity::kError, "depth image", "is 160x120, the colour image is 320x240");
  options_.depth_divisor = 1;
  options_.depth_unit_factor = 0.001;  // metres written as if they were millimetres
  expectFound(check(), Severity::kError, "depth image", "");
  options_.depth_unit_factor = 1;
  options_.depth_skew = 0.014;
  expectFound(check(), Severity::kNote, "colour and depth", "14.0 to 14.0 ms after");
  options_.depth_skew = 0;
  options_.depth_unit_factor = 10;
  expectFound(check(), Severity::kError, "depth image", "the sensor file uses 0.2");
  options_.depth_unit_factor = 1;
  options_.depth_skew = 5.0;
  expectFound(check(), Severity::kError, "colour image", "no time in common with the depth image");
}

TEST_F(CheckBag, EncodingAndRate) {
  options_.other_encoding = "bgr8";
  expectFound(check(), Severity::kWarning, "colour image", "encoding is bgr8, the sensor file says rgb8");
  options_.other_encoding.clear();
  options_.image_rate_factor = 0.4;
  options_.moving = 4;
  expectFound(check(), Severity::kError, "colour image", "12.0 Hz, the sensor file says 30 Hz");
}

TEST_F(CheckBag, ImuGaps) {
  options_.imu_hole_at = 1.5;
  options_.imu_hole = 0.25;
  const Findings findings = check();
  expectFound(findings, Severity::kError, "IMU", "at 1.5 s");
  expectFound(findings, Severity::kError, "IMU", "gaps");
}

TEST_F(CheckBag, AHoleIsNoQuietTime) {
  options_.imu_hole_at = 1.0;
  options_.imu_hole = 0.7;
  for (const Finding& f : check()) EXPECT_FALSE(f.about == "gravity" && f.severity > Severity::kNote) << f.text;
}

TEST_F(CheckBag, UnitsOfTheImu) {
  options_.accel_factor = 1 / 9.81;
  expectFound(check(), Severity::kError, "gravity", "in g");
  options_.accel_factor = 1.06;
  expectFound(check(), Severity::kWarning, "gravity", "10.40 m/s^2");
  options_.accel_factor = -1;
  expectFound(check(), Severity::kWarning, "gravity", "upside down");
  options_.accel_factor = 1;
  options_.gravity = false;
  expectFound(check(), Severity::kError, "gravity", "taken out");
  options_.gravity = true;
  options_.gyro_factor = 1 / kDegree;
  expectFound(check(), Severity::kError, "gyroscope", "degrees a second");
}

TEST_F(CheckBag, DelayBetweenCameraAndImu) {
  for (const double offset : {-0.030, 0.018}) {
    options_.sensor.time_offset = offset;
    test_support::writeDriverBag(path_, options_);
    const Recording recording = recordBag(path_, expected_, 60);
    const MotionEstimate motion = estimateMotion(recording, recording.rotations);
    ASSERT_TRUE(motion.usable) << motion.why_not;
    EXPECT_NEAR(motion.time_offset, offset, 0.001);
    EXPECT_LT(motion.time_sigma, 0.001);
    EXPECT_GT(motion.correlation, 0.95);
    expectFound(checkAll(recording), Severity::kWarning, "camera-IMU delay", "set time_offset");
    // With the right time_offset the check passes.
    Recording informed = recording;
    informed.sensor.time_offset = offset;
    expectFound(checkMotion(informed), Severity::kGood, "camera-IMU delay", "");
  }
}

TEST_F(CheckBag, ExtrinsicsThatContradictTheMotion) {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // camera axes in a body whose x points forward
  options_.sensor.T_imu_cam = SE3(R, Eigen::Vector3d(0.02, 0, 0));
  options_.tf = false;
  const Findings findings = check();
  expectFound(findings, Severity::kError, "extrinsics", "contradicts T_imu_cam by 1");
  expectNoErrorBut(findings, "extrinsics");
  const Recording recording = recordBag(path_, expected_, 60);
  const MotionEstimate motion = estimateMotion(recording, recording.rotations);
  EXPECT_LT(motion.R_imu_cam.angularDistance(Eigen::Quaterniond(R)), 0.006);
}

TEST_F(CheckBag, ExtrinsicsOfTfAreHeldAgainstTheMotionToo) {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  options_.sensor.T_imu_cam = SE3(R, Eigen::Vector3d(0.02, 0, 0));  // tf has it, the sensor file does not
  Findings findings = check();
  expectFound(findings, Severity::kWarning, "extrinsics", "contradicts T_imu_cam by 1");
  expectFound(findings, Severity::kGood, "extrinsics", "rotation of tf fits the motion");
  expectNoErrorBut(findings, "");
  // The other way about, what is used is wrong.
  Recording recording = recordBag(path_, expected_, 60);
  recording.sensor.T_imu_cam = options_.sensor.T_imu_cam;
  for (auto& transform : recording.tf) {
    auto& q = transform.transform.rotation;
    q.x = q.y = q.z = 0;
    q.w = 1;
  }
  findings = checkMotion(recording);
  expectFound(findings, Severity::kGood, "extrinsics", "rotation of T_imu_cam fits the motion");
  expectFound(findings, Severity::kError, "extrinsics", "the motion contradicts tf by 1");
}

TEST_F(CheckBag, FramesInTf) {
  options_.tf = false;
  expectFound(check(), Severity::kNote, "tf", "camera_color_optical_frame and camera_imu_optical_frame not in tf");
  options_.tf = true;
  options_.sensor.T_imu_cam.t() += Eigen::Vector3d(0.05, 0, 0);
  expectFound(check(), Severity::kWarning, "tf", "differs from the sensor file's T_imu_cam by 0.0 degrees and 5.0 cm");
}

// All else is told as without it.
TEST_F(CheckBag, TimeThatBeginsAnewIsTheOneCause) {
  options_.late_jump = -4294.967296;  // a counter of microseconds that wraps
  const Findings findings = check();
  expectFound(findings, Severity::kError, "clock", "time ran back by 4294.967 s (a clock that was set or wraps round");
  for (const Finding& f : findings)
    EXPECT_TRUE(f.severity < Severity::kWarning || f.about == "clock") << f.about << ": " << f.text;
}

TEST_F(CheckBag, AClockThatIsSetIsNamedAndFollowed) {
  options_.late_jump = -0.9;
  const Findings findings = check();
  expectFound(findings, Severity::kWarning, "clock", "was set back by 0.900 s");
  expectNoErrorBut(findings, "");
}

TEST_F(CheckBag, StampsOfImagesThatJitter) {
  test_support::writeDriverBag(path_, options_);
  const Recording sound = recordBag(path_, expected_, 60);
  Recording jittering = sound, varying = sound;
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, 0.003);
  for (double& t : jittering.color.stamps) t += normal(random);
  expectFound(checkRates(jittering), Severity::kWarning, "colour image", "stamps jitter by");
  // Auto-exposure varies the rate, with correct stamps.
  double t = varying.color.stamps.front();
  for (std::size_t i = 1; i < varying.color.stamps.size(); ++i)
    varying.color.stamps[i] = t += (1 + 0.15 * std::sin(0.3 * double(i))) / 30;
  for (const Findings& findings : {checkRates(sound), checkRates(varying)})
    for (const Finding& f : findings) EXPECT_EQ(f.text.find("jitter"), std::string::npos) << f.text;
}

TEST_F(CheckBag, StreamsThatDoNotCoverEachOther) {
  test_support::writeDriverBag(path_, options_);
  const Recording whole = recordBag(path_, expected_, 60);
  Recording stopped = whole;  // the IMU ends after a third
  stopped.imu.stamps.resize(stopped.imu.stamps.size() / 3);
  expectFound(checkRates(stopped), Severity::kError, "IMU", "before the others");
  Recording other_clock = whole;
  for (double& t : other_clock.imu.stamps) t += 1000;
  expectFound(checkRates(other_clock), Severity::kError, "IMU", "no time in common with the colour image");
  Recording unstamped = whole;
  for (double& t : unstamped.imu.stamps) t = 0;
  expectFound(checkRates(unstamped), Severity::kError, "IMU", "all stamps are the same");
  for (const Recording& recording : {other_clock, unstamped}) {
    const Findings all = checkRates(recording);
    EXPECT_EQ(std::count_if(all.begin(), all.end(), [](const Finding& f) { return f.severity == Severity::kError; }), 1)
        << "one cause, one advice\n"
        << toText(all, false);
  }
  Recording short_one = whole;
  short_one.color.stamps.resize(1);
  expectFound(checkRates(short_one), Severity::kError, "colour image", "1 messages in all");
}

TEST_F(CheckBag, ImagesThatShowNothing) {
  test_support::writeDriverBag(path_, options_);
  Recording recording = recordBag(path_, expected_, 60);
  ASSERT_FALSE(recording.brightness.empty());
  for (BrightnessSample& sample : recording.brightness) sample = {3, 0.5};
  expectFound(checkImages(recording), Severity::kError, "colour image", "shows nothing");
  for (DepthSample& sample : recording.depths) sample = {1, 1, 1.5, 0};
  expectFound(checkImages(recording), Severity::kError, "depth image", "every pixel says 1.5 m");
}

TEST_F(CheckBag, StreamsThatLieElsewhereInTheBag) {
  test_support::writeDriverBag(path_, options_);
  const Recording whole = recordBag(path_, expected_, 60);
  const auto late = [&](StreamRecord Recording::*stream, double seconds) {
    Recording moved = whole;
    for (double& t : (moved.*stream).arrivals) t += seconds;
    return checkRates(moved);
  };
  expectFound(late(&Recording::imu, 0.8), Severity::kError, "IMU", "0.8 s later in the bag");
  expectFound(late(&Recording::imu, 0.8), Severity::kError, "IMU", "imu_patience=2");
  expectFound(late(&Recording::depth, -1), Severity::kError, "depth image", "1.0 s earlier in the bag");
  for (const Finding& f : late(&Recording::imu, -0.5)) EXPECT_NE(f.severity, Severity::kError) << f.text;
}

TEST_F(CheckBag, WithoutDepthItIsSaidAndNoError) {
  expected_.topics.depth.clear();
  const Findings findings = check();
  expectFound(findings, Severity::kNote, "depth image", "visual-inertial only");
  expectNoErrorBut(findings, "");
}

TEST_F(CheckBag, WithoutAnImuItIsSaidAndNoError) {
  const std::string united = expected_.topics.imu;
  expected_.topics.imu.clear();
  Findings findings = check();
  expectFound(findings, Severity::kNote, "IMU", "an RGB-D camera alone");
  expectFound(findings, Severity::kNote, "IMU", "not checked for want of a gyroscope");
  expectFound(findings, Severity::kGood, "tf", "the camera is connected to base_link");
  EXPECT_LT(static_cast<int>(worst(findings)), static_cast<int>(Severity::kWarning)) << toText(findings, false);

  expected_.topics.accel = united;
  findings = check();
  expectFound(findings, Severity::kNote, "gyroscope", "an accelerometer alone");
  expectFound(findings, Severity::kGood, "gravity", "when quiet");
  EXPECT_LT(static_cast<int>(worst(findings)), static_cast<int>(Severity::kWarning)) << toText(findings, false);

  std::swap(expected_.topics.accel, expected_.topics.gyro);
  findings = check();
  expectFound(findings, Severity::kNote, "accelerometer", "a gyroscope alone");
  expectFound(findings, Severity::kGood, "camera-IMU delay", "measured");
  EXPECT_LT(static_cast<int>(worst(findings)), static_cast<int>(Severity::kWarning)) << toText(findings, false);
}

TEST_F(CheckBag, RegisteredDepthWithoutTheLensIsNamed) {
  options_.sensor.camera.distortion = {-0.12, 0.02, 0.0, 0.0, 0.0};
  options_.sensor.depth_undistorted = true;
  const Findings findings = check();
  expectFound(findings, Severity::kWarning, "depth camera_info", "has no distortion, that of colour has up to");
  expectNoErrorBut(findings, "");
  expected_.depth_undistorted = true;
  for (const Finding& f : check())
    EXPECT_FALSE(f.about == "depth camera_info" && f.severity == Severity::kWarning) << f.text;
}

TEST_F(CheckBag, ImagesThatComeAgain) {
  options_.repeat_every = 5;
  expectFound(check(), Severity::kWarning, "colour image", "repeat the pixels of the one before");
}

TEST_F(CheckBag, CalibrationOfTheSensorFile) {
  expected_.intrinsics_from_camera_info = false;
  expectFound(check(), Severity::kError, "camera", "the images are 320x240");
  options_.width = options_.height = 0;
  expected_.camera.fx *= 1.1;
  expectFound(check(), Severity::kWarning, "camera", "camera_info fx");
  expected_.camera.fx /= 1.1;
  expected_.camera.model = DistortionModel::kRadTan;
  expected_.camera.distortion = {-0.2, 0.03, 0, 0};
  expectFound(check(), Severity::kWarning, "camera", "distortion none: up to ");
}

TEST_F(CheckBag, ValuesThatAreNoNumbersAreNotTakenForADelay) {
  test_support::writeDriverBag(path_, options_);
  Recording recording = recordBag(path_, expected_, 60);
  for (std::size_t k = 0; k < recording.gyro_samples.size(); k += 7) recording.gyro_samples[k].value.x() = std::nan("");
  expectFound(checkImu(recording), Severity::kError, "gyroscope", "not numbers");
  EXPECT_NEAR(estimateMotion(recording, recording.rotations).time_offset, expected_.time_offset, 0.002);
}

TEST_F(CheckBag, TheEndOfTheGyrosRangeAndDepthThatRepeatsAreNamed) {
  test_support::writeDriverBag(path_, options_);
  Recording recording = recordBag(path_, expected_, 60);
  EXPECT_EQ(recording.gyro_range.samples(), 0u);
  EXPECT_GT(recording.depth.decoded, 10u);
  EXPECT_EQ(recording.depth.repeated, 0u);
  for (int k = 0; k < 20; ++k) recording.gyro_range.add(1e3 + 0.005 * k, {0, -34.9, 0});
  expectFound(checkImu(recording), Severity::kWarning, "gyroscope", "at the end of its range, 34.90 rad/s");
  recording.depth.repeated = recording.depth.decoded / 2;
  expectFound(checkImages(recording), Severity::kWarning, "depth image", "repeat the one before");
}

TEST_F(CheckBag, UnreadableBag) {
  std::ofstream(path_) << "not a bag";
  try {
    recordBag(path_, expected_, 60);
    ADD_FAILURE() << "was read";
  } catch (const std::exception& e) {
    EXPECT_NE(std::string(e.what()).find(path_), std::string::npos) << e.what();
  }
  EXPECT_THROW(recordBag("/nowhere/x.bag", expected_, 60), std::runtime_error);
}

}  // namespace
}  // namespace vip_slam
