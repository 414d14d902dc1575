// SPDX-License-Identifier: BSD-3-Clause
// The readout time of a rolling shutter, estimated from corners and gyro of a synthetic motion.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_bringup/preflight/readout.h"
#include "vip_slam_core/geometry/so3.h"

namespace vip_slam {
namespace {

constexpr double kHeight = 0.5;  // half of the image's height, normalised coordinates

/// A camera that sways about three axes and accelerates as it tilts.
struct Motion {
  Eigen::Quaterniond R_imu_cam{expQuaternion(Eigen::Vector3d(0.02, -0.03, 1.5))};
  Eigen::Vector3d bias{0.01, -0.02, 0.015};
  Eigen::Vector3d turn{0.3, 0.35, 0.2}, sway{0.5, 0.1, 0.2};  // rad, m
  Eigen::Vector3d phase{0, 1, 2};
  double end = 9.5;  // s

  static Motion random(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto any = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
    Motion m;
    m.R_imu_cam = expQuaternion(Eigen::Vector3d(2 * any()));
    m.bias = 0.02 * any();
    m.turn += 0.15 * any();
    m.sway += 0.2 * any();
    m.phase = 3 * any();
    m.end = 5.5;
    return m;
  }
  Eigen::Matrix3d R_W_C(double t) const {
    return expSO3(Eigen::Vector3d(turn.x() * std::sin(4 * t + phase.x()), turn.y() * std::sin(3.1 * t + phase.y()),
                                  turn.z() * std::sin(5 * t + phase.z())));
  }
  Eigen::Vector3d p_W_C(double t) const {
    return {sway.x() * std::sin(4 * t), sway.y() * std::sin(3.1 * t), sway.z() * std::sin(t)};
  }
  std::vector<StampedVector> gyro(double noise = 0) const {
    std::mt19937 random(17);
    std::normal_distribution<double> normal(0, noise);
    std::vector<StampedVector> samples;
    const double h = 1e-4;
    for (double t = -0.5; t < end + 1; t += 0.0025) {
      const Eigen::Vector3d rate_C = logSO3(Eigen::Matrix3d(R_W_C(t - h).transpose() * R_W_C(t + h))) / (2 * h);
      samples.push_back({t, R_imu_cam * rate_C + bias});
      if (noise > 0) samples.back().value += Eigen::Vector3d(normal(random), normal(random), normal(random));
    }
    return samples;
  }
};

struct Images {
  double readout = 0, delay = 0, drift = 0;   // s, s at the time 0, s/s
  double pixel_noise = 0.1, depth_noise = 0;  // px, share
  int corners = 60;
  unsigned seed = 5;
};

/// Images at 20 Hz whose stamps, of the middle row, are behind the gyro's clock by the delay.
std::vector<RotationStep> steps(const Motion& motion, const Images& images) {
  std::mt19937 random(images.seed);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  std::normal_distribution<double> normal;
  std::vector<RotationStep> list;
  const auto stamp = [&](double t) { return t - images.delay - images.drift * t; };
  const double readout = images.readout;
  for (double t = 0.2; t < motion.end; t += 0.05) {
    RotationStep step;
    step.t0 = stamp(t);
    step.t1 = stamp(t + 0.05);
    for (int i = 0; i < images.corners; ++i) {
      const double from = uniform(random), z = 2.5 + 2 * uniform(random);
      const Eigen::Vector3d p(uniform(random) * z, 2 * kHeight * from * z, z);
      const double t_from = t + readout * from;
      const Eigen::Vector3d p_W = motion.R_W_C(t_from) * p + motion.p_W_C(t_from);
      double to = from;  // iterate: the point is seen by the row onto which it projects at that row's time
      Eigen::Vector2d seen;
      for (int turn = 0; turn < 8; ++turn) {
        const double t_to = t + 0.05 + readout * to;
        seen = (motion.R_W_C(t_to).transpose() * (p_W - motion.p_W_C(t_to))).hnormalized();
        to = seen.y() / (2 * kHeight);
      }
      if (std::abs(to) > 0.5) continue;
      seen += images.pixel_noise / 480 * Eigen::Vector2d(normal(random), normal(random));
      if (i % 15 == 0) seen.x() += 0.05;  // a wrong match
      const double read = 1 + images.depth_noise * normal(random);
      step.tracks.push_back({(read * p).cast<float>(), seen.cast<float>(), float(from), float(to)});
    }
    list.push_back(step);
  }
  return list;
}

TEST(Readout, RowsAndDelayAreToldApart) {
  const Motion motion;
  const GyroIntegral gyro(motion.gyro());
  for (const double readout : {0.02, 0.0, -0.012}) {
    const ReadoutEstimate start{0.004, 0, motion.R_imu_cam * expQuaternion(Eigen::Vector3d(0.01, 0, -0.01))};
    const auto found = estimateReadout(steps(motion, {readout, 0.007}), gyro, start);
    ASSERT_TRUE(found) << readout;
    EXPECT_NEAR(found->readout, readout, 3e-4);
    EXPECT_NEAR(found->time_offset, 0.007, 1e-4);
    EXPECT_LT(found->R_imu_cam.angularDistance(motion.R_imu_cam), 2e-3);
    EXPECT_LT(found->readout_sigma, 3e-4);
    EXPECT_GT(found->readout_sigma, 1e-5);
  }
}

TEST(Readout, ADelayThatDriftsIsMeasured) {
  const Motion motion;
  const GyroIntegral gyro(motion.gyro());
  for (const double drift : {4e-4, -1e-3}) {
    const auto found = estimateReadout(steps(motion, {0.0, 0.002, drift}), gyro, {0, 0, motion.R_imu_cam});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->time_drift, drift, std::max(3e-5, 4 * found->drift_sigma));
    EXPECT_LT(found->drift_sigma, 5e-5);
    EXPECT_NEAR(found->imuTime(1.0), 1.0 + 0.002 + drift, 3e-4);
    EXPECT_NEAR(found->imuTime(9.0), 9.0 + 0.002 + 9 * drift, 3e-4);
  }
}

// Thirty recordings, each with a motion and noise of its own: the squared errors over the variances add up to 30, of
// which 99 in 100 such sums lie between 13.8 and 53.7.
TEST(Readout, SigmasAreThoseOfTheErrors) {
  constexpr int kRecordings = 30;
  double offset = 0, readout = 0, drift = 0;
  for (unsigned seed = 1; seed <= kRecordings; ++seed) {
    const Motion motion = Motion::random(seed);
    const Images images{0.01, 0.004, 2e-4, 0.1 + 0.3 * (seed % 3), 0.01, 35, seed};
    const auto found =
        estimateReadout(steps(motion, images), GyroIntegral(motion.gyro(2e-3)), {0, 0, motion.R_imu_cam});
    ASSERT_TRUE(found) << seed;
    const double truth = images.delay + images.drift * (found->middle + images.delay);
    offset += std::pow((found->time_offset - truth) / found->time_sigma, 2);
    readout += std::pow((found->readout - images.readout) / found->readout_sigma, 2);
    drift += std::pow((found->time_drift - images.drift) / found->drift_sigma, 2);
  }
  for (const auto& [name, sum] : {std::make_pair("delay", offset), {"readout", readout}, {"drift", drift}}) {
    EXPECT_GT(sum, 13.8) << name;
    EXPECT_LT(sum, 53.7) << name;
  }
}

TEST(Readout, UnknownWithoutDepthOrMotion) {
  const Motion motion;
  const GyroIntegral gyro(motion.gyro());
  std::vector<RotationStep> bare = steps(motion, {0.02});
  for (RotationStep& s : bare) s.tracks.clear();
  EXPECT_FALSE(estimateReadout(bare, gyro, {0, 0, motion.R_imu_cam}));

  std::vector<RotationStep> still = steps(motion, {});
  std::vector<StampedVector> rest = motion.gyro();
  for (StampedVector& s : rest) s.value = motion.bias;
  std::mt19937 random(6);
  std::normal_distribution<float> normal(0, 2e-4f);
  for (RotationStep& s : still)
    for (CornerTrack& track : s.tracks)
      track.image = track.point.hnormalized() + Eigen::Vector2f(normal(random), normal(random));
  const auto found = estimateReadout(still, GyroIntegral(rest), {0, 0, motion.R_imu_cam});
  EXPECT_TRUE(!found || found->readout_sigma > 0.003) << found->readout_sigma;
}

}  // namespace
}  // namespace vip_slam
