// SPDX-License-Identifier: BSD-3-Clause
// Poses of a folder: their accuracy, the noise of an IMU made from them, and their refinement by depth images.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "test_support.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_sim/io/pose_accuracy.h"
#include "vip_slam_sim/io/sequence_writer.h"
#include "vip_slam_sim/motion/motion_generator.h"
#include "vip_slam_sim/rng.h"

namespace vip_slam {
namespace {

Trajectory handheld(double rate, double seconds) {
  const SequenceSpec spec = loadSequence("07", libraryPath());
  const SplineTrajectory s = makeMotion(spec.motion, spec.T_imu_cam(), spec.seed);
  Trajectory out;
  for (int k = 0; k < rate * seconds; ++k) out.push_back({k / rate, s.at(5 + k / rate).T_W_I});
  return out;
}

Eigen::Vector3d gauss(Rng& rng, double sigma) {
  const double x = rng.gauss(), y = rng.gauss(), z = rng.gauss();
  return Eigen::Vector3d(sigma * x, sigma * y, sigma * z);
}

void addJitter(const PoseSigma& sigma, Trajectory* poses) {
  Rng rng(17);
  for (StampedPose& p : *poses) {
    const Eigen::Vector3d turn = gauss(rng, sigma.rotation), shift = gauss(rng, sigma.position);
    p.T_W_B = SE3(p.T_W_B.rotation() * expQuaternion(turn), p.T_W_B.t() + shift);
  }
}

TEST(PoseJitter, IsToldFromMotion) {
  Trajectory poses = handheld(30, 20);
  const PoseSigma smooth = poseJitter(poses);
  EXPECT_LT(smooth.position, 0.1e-3);
  EXPECT_LT(smooth.rotation, 0.01 * kDegree);
  const PoseSigma sigma{0.06 * kDegree, 0.9e-3};
  addJitter(sigma, &poses);
  const PoseSigma found = poseJitter(poses);
  EXPECT_NEAR(found.position, sigma.position, 0.1 * sigma.position);
  EXPECT_NEAR(found.rotation, sigma.rotation, 0.1 * sigma.rotation);
  EXPECT_EQ(poseJitter(Trajectory(poses.begin(), poses.begin() + 12)).position, 0);
}

TEST(SplineSpacing, IsWideForSmoothPosesAndFollowsFastOnes) {
  Trajectory poses = handheld(30, 10);
  const PoseSigma none;
  const double exact = splineSpacing(poses, none, 20), rough = splineSpacing(poses, {0.5 * kDegree, 10e-3}, 20);
  EXPECT_GT(rough, 1.9 * exact);
  // A hand tremor of 5 Hz needs knots closer than 200 ms.
  for (StampedPose& p : poses) p.T_W_B.t().x() += 0.004 * std::sin(2 * M_PI * 5 * p.t);
  EXPECT_LT(splineSpacing(poses, {0.05 * kDegree, 1e-3}, 20), 0.11);
}

TEST(NoiseOfImuFromPoses, CoversJitterAndDrift) {
  ImuNoise own;
  own.gyro_noise_density = 2e-4;
  own.accel_noise_density = 2e-3;
  const ImuNoise exact = noiseOfImuFromPoses(own, {}, 1.0 / 30, {});
  EXPECT_DOUBLE_EQ(exact.gyro_noise_density, 2e-4);
  EXPECT_DOUBLE_EQ(exact.accel_noise_density, 2e-3);
  // Jitter of 1 mrad: two poses differ by 1.41 mrad after a thirtieth of a second.
  const ImuNoise rough = noiseOfImuFromPoses(own, {1e-3, 1e-3}, 1.0 / 30, {});
  EXPECT_NEAR(rough.gyro_noise_density * std::sqrt(1.0 / 30), std::sqrt(2.0) * 1e-3, 5e-5);
  EXPECT_NEAR(rough.accel_noise_density * std::sqrt(std::pow(1.0 / 30, 3) / 3), std::sqrt(2.0) * 1e-3, 5e-5);
  // Disagreement that is constant over the lags is registration noise, growth is pose drift. Lags without pairs are
  // ignored.
  const PoseSigma own_error{1e-3, 1e-3}, grown{std::hypot(1e-3, 8e-3), 1e-3};
  EXPECT_DOUBLE_EQ(
      noiseOfImuFromPoses(own, {}, 1.0 / 30, {{0.1, 9, own_error}, {1.1, 9, own_error}}).gyro_noise_density, 2e-4);
  const ImuNoise drift =
      noiseOfImuFromPoses(own, {}, 1.0 / 30, {{0.1, 9, own_error}, {0.5, 0, grown}, {1.1, 9, grown}});
  EXPECT_NEAR(drift.gyro_noise_density, 8e-3, 1e-5);
  EXPECT_NEAR(drift.accel_noise_density, 9.81 * 8e-3, 1e-4);
  EXPECT_DOUBLE_EQ(drift.gyro_random_walk, own.gyro_random_walk);
}

/// A rendered folder in a scratch directory.
class RenderedFolder : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::path(testing::TempDir()) / ("vip_slam_sim_pose_accuracy_" + std::to_string(getpid()));
    SequenceSpec spec = loadSequence("07", libraryPath());
    spec.camera.rate = 10;
    SequenceRenderer s(spec, quickOptions(100, 45));
    {
      const auto writer = makeFolderWriter(path_.string());
      s.render([&](const SimFrame& f) {
        writer->frame(f);
        return true;
      });
      writer->commit();
    }
    folder_ = openRgbdFolder(path_.string(), 30);
    folder_.camera = s.sensor().camera;
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::filesystem::path path_;
  RgbdFolder folder_;
};

TEST_F(RenderedFolder, DepthTellsHowFarPosesAreOffAndMendsThem) {
  const std::vector<double> lags = {0.1, 1.0};
  const auto exact = posesAgainstDepth(folder_, folder_.T_W_C, lags);
  for (const DepthDisagreement& d : exact) {
    std::printf("  exact poses, %.1f s: %.2f mm, %.3f deg (%d pairs)\n", d.lag, 1000 * d.error.position,
                d.error.rotation / kDegree, d.pairs);
    ASSERT_GT(d.pairs, 10);
    EXPECT_LT(d.error.position, 8e-3);
    EXPECT_LT(d.error.rotation, 0.1 * kDegree);
  }

  // Poses that drift by 1.2 deg and 25 mm within 1.5 s, and jump.
  const Trajectory truth = folder_.T_W_C;
  for (StampedPose& p : folder_.T_W_C) {
    const double phase = 2 * M_PI * (p.t - truth.front().t) / 3;
    const bool late = p.t > truth.front().t + 2.2;
    const SE3 error(expQuaternion(Eigen::Vector3d(0.6 * kDegree * std::sin(phase), 0, late ? 0.8 * kDegree : 0)),
                    Eigen::Vector3d(0, 0.0125 * std::cos(phase), late ? 0.02 : 0));
    p.T_W_B = p.T_W_B * error;
  }
  const auto drift = posesAgainstDepth(folder_, folder_.T_W_C, lags);
  EXPECT_GT(drift[1].error.rotation, 0.3 * kDegree);
  EXPECT_GT(drift[1].error.position, 0.006);

  const auto errorOver = [&](const Trajectory& poses, std::size_t step) {
    PoseSigma worst;
    for (std::size_t i = 0; i + step < poses.size(); ++i) {
      const SE3 a = truth[i].T_W_B.inverse() * truth[i + step].T_W_B;
      const SE3 b = poses[i].T_W_B.inverse() * poses[i + step].T_W_B;
      worst.position = std::max(worst.position, (a.t() - b.t()).norm());
      worst.rotation = std::max(worst.rotation, logSO3(a.rotation().conjugate() * b.rotation()).norm());
    }
    return worst;
  };
  const Trajectory mended = refinePoses(folder_, {0.05 * kDegree, 1e-3}, drift[1].error);
  ASSERT_EQ(mended.size(), truth.size());
  const PoseSigma before = errorOver(folder_.T_W_C, 10), after = errorOver(mended, 10);
  std::printf("  over 1 s: %.1f mm and %.2f deg at most, mended %.1f mm and %.2f deg\n", 1000 * before.position,
              before.rotation / kDegree, 1000 * after.position, after.rotation / kDegree);
  EXPECT_LT(after.position, 0.5 * before.position);
  EXPECT_LT(after.rotation, 0.35 * before.rotation);
}

}  // namespace
}  // namespace vip_slam
