// SPDX-License-Identifier: BSD-3-Clause
// Axes of accelerometer and gyroscope, mirrored pictures, the unit of depth and the reading of a calibration, each
// found from the motion of a rendered bag whose recording is changed accordingly.
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "driver_bag.h"
#include "vip_slam_bringup/preflight/camera_readings.h"
#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/image_rotation.h"
#include "vip_slam_bringup/preflight/recorder.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_ros/camera_info.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

class MotionCause : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::string path =
        (fs::temp_directory_path() / ("vip_slam_motion_" + std::to_string(::getpid()) + ".bag")).string();
    test_support::DriverBagOptions options;
    options.sensor = loadSensorConfig(CONFIG_DIR "/sensors/d435i.yaml");
    options.width = 320;
    options.height = 240;
    options.moving = 9;
    test_support::writeDriverBag(path, options);
    sound_ = new Recording(recordBag(path, options.sensor, 60));
    fs::remove(path);
  }
  static void TearDownTestSuite() {
    delete sound_;
    sound_ = nullptr;
  }
  /// The recording as another camera has it: `moved` changes each pixel.
  template <class Move>
  static Recording withPixels(const Move& moved) {
    Recording r = *sound_;
    r.rotations.clear();
    const auto camera = makeCamera(r.color_camera);
    for (PixelStep& step : r.pixel_steps) {
      for (PixelTrack& track : step.tracks) track.from = moved(track.from), track.to = moved(track.to);
      if (const auto seen = seenBy(*camera, step)) r.rotations.push_back(*seen);
    }
    return r;
  }
  static void expectOnlyError(const Recording& r, const std::string& about, const std::string& words) {
    const Findings findings = checkMotion(r);
    ASSERT_EQ(findings.size(), 1u) << toText(findings, false);
    EXPECT_EQ(findings[0].severity, Severity::kError);
    EXPECT_EQ(findings[0].about, about);
    EXPECT_NE((findings[0].text + " -> " + findings[0].advice).find(words), std::string::npos)
        << toText(findings, false);
  }
  static Recording* sound_;
};
Recording* MotionCause::sound_ = nullptr;

TEST_F(MotionCause, ASoundRecordingHasTheConfiguredAxesAndScale) {
  const MotionEstimate motion = estimateMotion(*sound_, sound_->rotations);
  ASSERT_TRUE(motion.usable) << motion.why_not;
  ASSERT_TRUE(motion.inertial);
  EXPECT_TRUE(motion.inertial->axes_known);
  EXPECT_TRUE(motion.inertial->axes.isIdentity());
  EXPECT_NEAR(motion.inertial->scale, 1, std::max(0.02, 4 * motion.inertial->scale_sigma));
  EXPECT_FALSE(inertialFinding(*sound_, motion));
}

TEST_F(MotionCause, ADepthUnitOfFourFifthsIsNamedWithTheValueToEnter) {
  Recording r = *sound_;
  r.rotations.clear();
  const auto camera = makeCamera(r.color_camera);
  for (PixelStep& step : r.pixel_steps) {
    for (PixelTrack& track : step.tracks) track.z *= 0.8f;
    if (const auto seen = seenBy(*camera, step)) r.rotations.push_back(*seen);
  }
  const MotionEstimate motion = estimateMotion(r, r.rotations);
  ASSERT_TRUE(motion.inertial);
  EXPECT_NEAR(motion.inertial->scale, 1.25, std::max(0.025, 4 * motion.inertial->scale_sigma));
  expectOnlyError(r, "depth scale", "set depth/scale: 0.0012");
}

TEST_F(MotionCause, AxesOfTheAccelerometerThatAreNotTheGyroscopes) {
  Eigen::Matrix3d turned;
  turned << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Recording r = *sound_;
  for (StampedVector& s : r.accel_samples) s.value = turned * s.value;
  expectOnlyError(r, "IMU",
                  "x, y, z of the accelerometer are z, -x, -y of the gyroscope; T_imu_cam is right for the gyro");
  r = *sound_;
  for (StampedVector& s : r.gyro_samples) s.value = turned * s.value;
  expectOnlyError(r, "IMU",
                  "x, y, z of the accelerometer are -y, -z, x of the gyroscope; T_imu_cam is right for the acc");
  r = *sound_;
  for (StampedVector& s : r.accel_samples) s.value *= -1;
  expectOnlyError(r, "accelerometer", "opposite sign");
}

TEST_F(MotionCause, AGyroscopeInDegreesForAWhileIsNamedWithItsTime) {
  Recording r = *sound_;
  const double start = r.color.stamps.front();
  for (StampedVector& s : r.gyro_samples)
    if (s.t > start + 6) s.value *= 180 / M_PI;
  expectOnlyError(r, "gyroscope", "times as fast as the images from 6.");
}

TEST_F(MotionCause, AClockThatDriftsIsNamedWithItsRate) {
  Recording r = *sound_;
  const double start = r.color.stamps.front();
  for (RotationStep& s : r.rotations) s.t0 -= 1e-3 * (s.t0 - start), s.t1 -= 1e-3 * (s.t1 - start);
  std::string found;
  for (const Finding& f : checkMotion(r))
    if (f.about == "camera-IMU delay") found += f.text;
  EXPECT_NE(found.find("drifts by +"), std::string::npos) << found;
}

TEST_F(MotionCause, MirroredPicturesAreNamed) {
  const float width = float(sound_->color_camera.width), height = float(sound_->color_camera.height);
  expectOnlyError(withPixels([&](const Eigen::Vector2f& p) { return Eigen::Vector2f(width - 1 - p.x(), p.y()); }),
                  "colour image", "mirrored, left and right");
  expectOnlyError(withPixels([&](const Eigen::Vector2f& p) { return Eigen::Vector2f(p.x(), height - 1 - p.y()); }),
                  "colour image", "mirrored, top and bottom");
}

TEST_F(MotionCause, ALensUnderAnotherModelsNameIsNamed) {
  CameraIntrinsics fisheye = sound_->color_camera;
  fisheye.model = DistortionModel::kEquidistant;
  fisheye.distortion = {0.01, -0.004, 0, 0};
  const auto given = makeCamera(sound_->color_camera), lens = makeCamera(fisheye);
  Recording r = withPixels([&](const Eigen::Vector2f& p) {
    Eigen::Vector2d xy;
    given->undistort(p.cast<double>(), &xy);
    return Eigen::Vector2f(lens->distort(xy).cast<float>());
  });
  r.color_camera.model = DistortionModel::kRadTan;
  r.color_camera.distortion = {0.01, -0.004, 0, 0, 0};
  r.rotations.clear();
  const auto wrong = makeCamera(r.color_camera);
  for (const PixelStep& step : r.pixel_steps)
    if (const auto seen = seenBy(*wrong, step)) r.rotations.push_back(*seen);
  r.camera_readings = otherReadings(r.color_camera);
  expectOnlyError(r, "colour camera_info", "model: equidistant, distortion: [0.01, -0.004, 0, 0]");
  // Named rightly, nothing else fits better.
  r.color_camera = fisheye;
  r.rotations.clear();
  for (const PixelStep& step : r.pixel_steps)
    if (const auto seen = seenBy(*lens, step)) r.rotations.push_back(*seen);
  r.camera_readings = otherReadings(fisheye);
  EXPECT_FALSE(r.camera_readings.empty());
  for (const Finding& f : checkMotion(r)) EXPECT_NE(f.severity, Severity::kError) << f.text;
}

TEST_F(MotionCause, ASensorFileWithoutTheLensThatCameraInfoKnowsIsNamed) {
  CameraIntrinsics lens = sound_->color_camera;
  lens.model = DistortionModel::kRadTan;
  lens.distortion = {-0.25, 0.06, 0, 0};
  const auto pinhole = makeCamera(sound_->color_camera), distorting = makeCamera(lens);
  Recording r = withPixels([&](const Eigen::Vector2f& p) {
    Eigen::Vector2d xy;
    pinhole->undistort(p.cast<double>(), &xy);
    return Eigen::Vector2f(distorting->distort(xy).cast<float>());
  });
  r.sensor.intrinsics_from_camera_info = false;
  r.sensor.camera = sound_->color_camera;
  r.color_camera = lens;
  r.rotations.clear();
  for (const PixelStep& step : r.pixel_steps)
    if (const auto seen = seenBy(*pinhole, step)) r.rotations.push_back(*seen);
  r.camera_readings = otherReadings(r.sensor.camera, r.color_camera);
  expectOnlyError(r, "camera", "camera_info holds, not the camera of the sensor file");
}

// As it is, K is of the images; taken otherwise the motion tells, whatever the principal point is like.
TEST_F(MotionCause, BinningThatKHasAlreadyOrHasNot) {
  const CameraIntrinsics& camera = sound_->color_camera;
  for (const bool already : {true, false}) {
    CameraIntrinsics of_info = already ? camera : camera.scaled(2 * camera.width, 2 * camera.height);
    sensor_msgs::CameraInfo info = toCameraInfo(of_info);
    info.width = 2 * camera.width, info.height = 2 * camera.height;
    info.binning_x = info.binning_y = 2;
    EXPECT_NEAR(intrinsicsFromCameraInfo(info).fx, camera.fx, 1e-9);

    Recording r = *sound_;
    r.color_camera.fx *= already ? 0.5 : 2, r.color_camera.fy *= already ? 0.5 : 2;
    r.color_camera.cx = (camera.cx + 0.5) * (already ? 0.5 : 2) - 0.5;
    r.color_camera.cy = (camera.cy + 0.5) * (already ? 0.5 : 2) - 0.5;
    r.camera_readings = otherReadings(r.color_camera, info);
    ASSERT_EQ(r.camera_readings.size(), 1u);
    r.rotations.clear();
    const auto wrong = makeCamera(r.color_camera);
    for (const PixelStep& step : r.pixel_steps)
      if (const auto seen = seenBy(*wrong, step)) r.rotations.push_back(*seen);
    expectOnlyError(r, "colour camera_info",
                    already ? "K is that of the images already" : "K is that of the whole sensor");
  }
}

TEST(Smoothed, AnImuThatLosesFastTurnsOnlyIsNamed) {
  // Slow turns and a hand's tremble of 2.5 Hz; the filter has one pole, at `cut_off`.
  const auto rate = [](double t) {
    const auto sway = [&](double slow, double fast, double phase) {
      return 0.5 * std::sin(slow * t + phase) + 0.4 * std::sin(2 * M_PI * fast * t + phase);
    };
    return Eigen::Vector3d(sway(1.1, 2.5, 0), sway(0.7, 2.2, 1), sway(0.9, 2.8, 2));
  };
  for (const double cut_off : {6.0, 200.0}) {
    Recording r;
    r.sensor.T_imu_cam = SE3();
    Eigen::Vector3d state = rate(0);
    for (double t = 0; t < 20; t += 0.002) {
      state += (1 - std::exp(-2 * M_PI * cut_off * 0.002)) * (rate(t) - state);
      r.gyro_samples.push_back({t, state + Eigen::Vector3d(0.02, -0.01, 0.03)});
    }
    for (double t = 0.5; t < 19; t += 0.05) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (int i = 0; i < 10; ++i) mean += 0.1 * rate(t + 0.005 * i + 0.0025);
      r.rotations.push_back({t, t + 0.05, mean, {}, {}});
    }
    bool named = false;
    for (const Finding& f : checkMotion(r)) named |= f.about == "IMU" && f.text.find("smoothed") != std::string::npos;
    EXPECT_EQ(named, cut_off < 100) << toText(checkMotion(r), false);
  }
}

TEST_F(MotionCause, ADelayThatIsNotTheSameInBothHalvesIsNotAdvised) {
  Recording r = *sound_;
  const double middle = r.rotations[r.rotations.size() / 2].t0;
  for (RotationStep& s : r.rotations)
    if (s.t0 >= middle) s.t0 += 0.02, s.t1 += 0.02;
  bool named = false;
  for (const Finding& f : checkMotion(r)) {
    EXPECT_EQ(f.advice.find("set time_offset"), std::string::npos) << f.advice;
    named |= f.text.find("in the first half") != std::string::npos;
  }
  EXPECT_TRUE(named);
}

TEST_F(MotionCause, WithoutDepthTheDelayIsNotAsSure) {
  Recording r = *sound_;
  const double sure = estimateMotion(r, r.rotations).time_sigma;
  for (RotationStep& s : r.rotations) s.tracks.clear();
  EXPECT_GT(estimateMotion(r, r.rotations).time_sigma, std::max(0.009, sure));
}

TEST_F(MotionCause, CornersThatStandStillWhileTheGyroscopeTurns) {
  Recording r = *sound_;
  r.rotations.clear();
  const auto camera = makeCamera(r.color_camera);
  for (PixelStep& step : r.pixel_steps) {
    for (std::size_t i = 0; i < step.tracks.size(); ++i)
      if (i % 8 != 0) step.tracks[i].to = step.tracks[i].from;
    if (const auto seen = seenBy(*camera, step)) r.rotations.push_back(*seen);
  }
  const Findings findings = checkMotion(r);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].about, "colour image");
  EXPECT_NE(findings[0].advice.find("emitter"), std::string::npos) << toText(findings, false);
}

TEST_F(MotionCause, ShakingWhileTheImagesStandStill) {
  Recording r = *sound_;
  EXPECT_TRUE(checkShaking(r).empty());
  for (PixelStep& step : r.pixel_steps)
    for (PixelTrack& track : step.tracks) track.to = track.from;
  for (StampedVector& s : r.accel_samples) s.value = Eigen::Vector3d(4 * std::sin(2 * M_PI * 31 * s.t), -9.8, 0);
  for (StampedVector& s : r.gyro_samples) s.value = Eigen::Vector3d(0, 0.2 * std::sin(2 * M_PI * 29 * s.t), 0);
  const Findings findings = checkShaking(r);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::kError);
  EXPECT_NE(findings[0].text.find("by 1.6"), std::string::npos) << findings[0].text;  // 4 / sqrt(2 * 3)
  EXPECT_NE(findings[0].advice.find("set imu/accel_noise_density: 0."), std::string::npos) << findings[0].advice;
}

}  // namespace
}  // namespace vip_slam
