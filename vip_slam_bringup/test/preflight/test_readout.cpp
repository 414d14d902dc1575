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

  static Eigen::Matrix3d R_W_C(double t) {
    return expSO3(Eigen::Vector3d(0.3 * std::sin(4 * t), 0.35 * std::sin(3.1 * t + 1), 0.2 * std::sin(5 * t + 2)));
  }
  static Eigen::Vector3d p_W_C(double t) { return {0.5 * std::sin(4 * t), 0.1 * std::sin(3.1 * t), 0.2 * std::sin(t)}; }
  std::vector<StampedVector> gyro() const {
    std::vector<StampedVector> samples;
    const double h = 1e-4;
    for (double t = -0.5; t < 10.5; t += 0.0025) {
      const Eigen::Vector3d rate_C = logSO3(Eigen::Matrix3d(R_W_C(t - h).transpose() * R_W_C(t + h))) / (2 * h);
      samples.push_back({t, R_imu_cam * rate_C + bias});
    }
    return samples;
  }
};

/// Images at 20 Hz whose stamps, of the middle row, are `delay` behind the gyro's clock.
std::vector<RotationStep> steps(double readout, double delay, double pixel_noise) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  std::normal_distribution<double> normal;
  std::vector<RotationStep> list;
  for (double t = 0.2; t < 9.5; t += 0.05) {
    RotationStep step;
    step.t0 = t - delay;
    step.t1 = t + 0.05 - delay;
    for (int i = 0; i < 60; ++i) {
      const double from = uniform(random), z = 2.5 + 2 * uniform(random);
      const Eigen::Vector3d p(uniform(random) * z, 2 * kHeight * from * z, z);
      const double t_from = t + readout * from;
      const Eigen::Vector3d p_W = Motion::R_W_C(t_from) * p + Motion::p_W_C(t_from);
      double to = from;  // iterate: the point is seen by the row onto which it projects at that row's time
      Eigen::Vector2d seen;
      for (int turn = 0; turn < 8; ++turn) {
        const double t_to = t + 0.05 + readout * to;
        seen = (Motion::R_W_C(t_to).transpose() * (p_W - Motion::p_W_C(t_to))).hnormalized();
        to = seen.y() / (2 * kHeight);
      }
      if (std::abs(to) > 0.5) continue;
      seen += pixel_noise / 480 * Eigen::Vector2d(normal(random), normal(random));
      if (i % 15 == 0) seen.x() += 0.05;  // a wrong match
      step.tracks.push_back({p.cast<float>(), seen.cast<float>(), float(from), float(to)});
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
    const auto found = estimateReadout(steps(readout, 0.007, 0.1), gyro, start);
    ASSERT_TRUE(found) << readout;
    EXPECT_NEAR(found->readout, readout, 3e-4);
    EXPECT_NEAR(found->time_offset, 0.007, 1e-4);
    EXPECT_LT(found->R_imu_cam.angularDistance(motion.R_imu_cam), 2e-3);
    EXPECT_LT(found->readout_sigma, 3e-4);
    EXPECT_GT(found->readout_sigma, 1e-5);
  }
}

TEST(Readout, UnknownWithoutDepthOrMotion) {
  const Motion motion;
  const GyroIntegral gyro(motion.gyro());
  std::vector<RotationStep> bare = steps(0.02, 0, 0.1);
  for (RotationStep& s : bare) s.tracks.clear();
  EXPECT_FALSE(estimateReadout(bare, gyro, {0, 0, motion.R_imu_cam}));

  std::vector<RotationStep> still = steps(0.0, 0, 0.1);
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
