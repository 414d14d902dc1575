// SPDX-License-Identifier: BSD-3-Clause
// Trajectories with known errors.
#include <gtest/gtest.h>

#include <random>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/testing/analytic_motion.h"
#include "vip_slam_eval/metrics/trajectory_consistency.h"
#include "vip_slam_eval/metrics/trajectory_metrics.h"

namespace vip_slam {
namespace {

Trajectory motion(double duration, double rate, unsigned seed = 1) {
  const testing::AnalyticMotion source(seed);
  Trajectory trajectory;
  for (int k = 0; k <= duration * rate; ++k) trajectory.push_back({k / rate, source.stateAt(k / rate).T_W_I});
  return trajectory;
}

Trajectory moved(const SE3& T_M_W, Trajectory trajectory) {
  for (StampedPose& pose : trajectory) pose.T_W_B = T_M_W * pose.T_W_B;
  return trajectory;
}

const SE3 kTilted(expQuaternion({0.3, -0.5, 1.1}), {4, -2, 1});
const SE3 kTurned(expQuaternion({0, 0, 2.2}), {-7, 3, 0.5});
const SE3 kShifted(Eigen::Quaterniond::Identity(), {1, 2, 3});

TEST(Statistics, KnownValues) {
  const ErrorStatistics s = summarise({3, 1, 2, 4});
  EXPECT_EQ(s.count, 4u);
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(30.0 / 4));
  EXPECT_DOUBLE_EQ(s.max, 4);
  EXPECT_EQ(summarise({}).count, 0u);
}

TEST(Alignment, EachForgivesWhatItShould) {
  const Trajectory truth = motion(20, 50);
  const auto rmse = [&](const SE3& T_M_W, Alignment alignment) {
    return absoluteError(associate(truth, moved(T_M_W, truth)), alignment).position.rmse;
  };
  EXPECT_LT(rmse(kTilted, Alignment::kSe3), 1e-12);
  EXPECT_GT(rmse(kTilted, Alignment::kYaw), 0.05);
  EXPECT_LT(rmse(kTurned, Alignment::kSe3), 1e-12);
  EXPECT_LT(rmse(kTurned, Alignment::kYaw), 1e-12);
  EXPECT_GT(rmse(kTurned, Alignment::kPosition), 0.05);
  EXPECT_LT(rmse(kShifted, Alignment::kPosition), 1e-12);
  EXPECT_NEAR(rmse(kShifted, Alignment::kNone), std::sqrt(14.0), 1e-12);
}

TEST(Alignment, ReturnsTheTransformation) {
  const Trajectory truth = motion(20, 50);
  const SE3 T = align(associate(truth, moved(kTilted, truth)), Alignment::kSe3);
  EXPECT_LT((T * kTilted).log().norm(), 1e-12);
  EXPECT_THROW(align({}, Alignment::kSe3), std::invalid_argument);
  EXPECT_THROW(alignmentFromName("scale"), std::invalid_argument);
  EXPECT_EQ(alignmentFromName("yaw"), Alignment::kYaw);
}

TEST(Alignment, OfACameraThatStoodComesFromItsOrientations) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.002);
  const SE3 at(expQuaternion({0.2, -0.1, 0.7}), {1, 2, 1.4});
  Trajectory truth, estimate;
  for (int k = 0; k < 400; ++k) {
    truth.push_back({0.1 * k, at});
    const SE3 jitter(expQuaternion({0, 0, noise(random)}), {noise(random), noise(random), noise(random)});
    estimate.push_back({0.1 * k, at * jitter});
  }
  for (const Alignment alignment : {Alignment::kYaw, Alignment::kSe3}) {
    const AbsoluteError error = absoluteError(associate(truth, moved(kTurned, estimate)), alignment);
    EXPECT_LT(error.rotation.rmse, 0.3) << alignmentName(alignment);
    EXPECT_LT(error.position.rmse, 0.005) << alignmentName(alignment);
  }
}

TEST(Alignment, OfAStraightPathTakesTheRollFromTheOrientations) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 0.002);
  Trajectory truth, estimate;
  for (int k = 0; k < 400; ++k) {
    truth.push_back({0.1 * k, SE3(Eigen::Quaterniond::Identity(), {0.01 * k, 0, 1.4})});
    estimate.push_back(truth.back());
    estimate.back().T_W_B.t() += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  const AbsoluteError error = absoluteError(associate(truth, moved(kTilted, estimate)), Alignment::kSe3);
  EXPECT_LT(error.rotation.rmse, 0.3);
}

TEST(AbsoluteErrorTest, AlternatingOffsetsGiveTheirSize) {
  const Trajectory truth = motion(20, 50);
  Trajectory estimate = truth;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].T_W_B.t().x() += i % 2 ? 0.03 : -0.03;
    estimate[i].T_W_B.setRotation(estimate[i].T_W_B.rotation() * expQuaternion({0, 0, 0.02}));
  }
  const AbsoluteError error = absoluteError(associate(truth, moved(kTurned, estimate)), Alignment::kYaw);
  EXPECT_NEAR(error.position.rmse, 0.03, 1e-4);
  EXPECT_NEAR(error.position.max, 0.03, 1e-3);
  EXPECT_NEAR(error.rotation.median, 0.02 / kDegree, 0.01);
}

TEST(Association, InterpolatesTheTruthAndRefusesGapsAndOffsets) {
  Trajectory truth = motion(10, 100);
  Trajectory estimate;
  const testing::AnalyticMotion source(1);
  for (double t = 0.503; t < 9; t += 0.05) estimate.push_back({t, source.stateAt(t).T_W_I});
  EXPECT_LT(absoluteError(associate(truth, estimate), Alignment::kNone).position.max, 1e-4);

  truth.erase(truth.begin() + 200, truth.begin() + 400);  // 2 s without truth
  const auto pairs = associate(truth, estimate);
  EXPECT_NEAR(double(estimate.size() - pairs.size()), 40, 1);

  Trajectory late = estimate;
  for (StampedPose& pose : late) pose.t += 0.2;
  EXPECT_LT(absoluteError(associate(truth, late, 0.1, -0.2), Alignment::kNone).position.max, 1e-4);
  EXPECT_GT(absoluteError(associate(truth, late), Alignment::kNone).position.rmse, 0.02);
}

TEST(RelativeErrorTest, ConstantDriftIsProportionalToTimeAndDistance) {
  // Straight line at 0.5 m/s, estimate 1 % long.
  Trajectory truth, estimate;
  for (int k = 0; k <= 1000; ++k) {
    const double t = 0.02 * k;
    truth.push_back({t, SE3(Eigen::Quaterniond::Identity(), {0.5 * t, 0, 0})});
    estimate.push_back({t, SE3(Eigen::Quaterniond::Identity(), {0.505 * t, 0, 0})});
  }
  const auto pairs = associate(truth, moved(kTilted, estimate));
  const RelativeError time = relativeErrorOverTime(pairs, 2.0);
  EXPECT_EQ(time.position.count, 901u);
  EXPECT_NEAR(time.position.rmse, 0.01, 1e-9);
  EXPECT_NEAR(time.rotation.max, 0, 1e-6);
  const RelativeError distance = relativeErrorOverDistance(pairs, 5.0);
  EXPECT_NEAR(distance.position.rmse, 0.05, 2e-4);
  EXPECT_NEAR(truePathLength(pairs), 10.0, 1e-9);
  EXPECT_EQ(relativeErrorOverDistance(pairs, 50.0).position.count, 0u);
  EXPECT_EQ(relativeErrorOverTime(pairs, 50.0).position.count, 0u);
}

TEST(RelativeErrorTest, YawDrift) {
  Trajectory truth = motion(20, 50), estimate = truth;
  for (StampedPose& pose : estimate) {
    pose.T_W_B = SE3(expQuaternion({0, 0, 0.01 * pose.t}), Eigen::Vector3d::Zero()) * pose.T_W_B;
  }
  EXPECT_NEAR(relativeErrorOverTime(associate(truth, estimate), 1.0).rotation.rmse, 0.01 / kDegree, 1e-6);
}

TEST(CoverageTest, FindsHolesAndMissingEnds) {
  const Trajectory truth = motion(10, 100);
  Trajectory estimate;
  for (const StampedPose& pose : truth) {
    if (pose.t < 1.0 || (pose.t > 4.0 && pose.t < 6.0) || pose.t > 9.5) continue;
    estimate.push_back(pose);
  }
  const Coverage result = coverage(truth, estimate, 0.2);
  ASSERT_EQ(result.gaps.size(), 3u);
  EXPECT_NEAR(result.longest_gap, 2.0, 1e-9);
  EXPECT_NEAR(result.gaps[1].begin, 4.0, 1e-9);
  EXPECT_NEAR(result.fraction, 0.65, 1e-9);
  EXPECT_DOUBLE_EQ(coverage(truth, truth, 0.2).fraction, 1.0);
  EXPECT_DOUBLE_EQ(coverage(truth, {}, 0.2).fraction, 0.0);
}

class NeesTest : public ::testing::Test {
 protected:
  // Poses with errors drawn from `P` scaled by `optimism`, in a turned world.
  std::vector<PoseWithCovariance> draw(double optimism) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    Matrix6d A;
    for (int k = 0; k < 36; ++k) A(k) = normal(random);
    const Matrix6d L = 0.004 * (A + 3 * Matrix6d::Identity());
    std::vector<PoseWithCovariance> samples;
    for (const StampedPose& pose : truth_) {
      Vector6d e;
      for (int k = 0; k < 6; ++k) e[k] = normal(random);
      e = L * e * (samples.empty() ? 0.0 : optimism);  // the first pose aligns the worlds and must be exact
      PoseWithCovariance sample;
      sample.t = pose.t;
      const SE3 T = kTurned * pose.T_W_B;
      sample.T_M_B = SE3(expQuaternion(e.tail<3>()) * T.rotation(), T.t() + e.head<3>());
      sample.covariance = L * L.transpose();
      samples.push_back(sample);
    }
    return samples;
  }
  Trajectory truth_ = motion(60, 50);
};

TEST_F(NeesTest, HonestCovariancesGiveTheirDegreesOfFreedom) {
  const Nees honest = nees(truth_, draw(1.0));
  EXPECT_NEAR(honest.pose.mean, 6.0, 0.3);
  EXPECT_NEAR(honest.position.mean, 3.0, 0.2);
  EXPECT_NEAR(honest.rotation.mean, 3.0, 0.2);
  EXPECT_NEAR(honest.within_95, 0.95, 0.015);
  EXPECT_EQ(honest.unusable, 0u);
}

/// EuRoC's IMU has its x axis up, so that axis has no heading for aligning the worlds.
TEST_F(NeesTest, TheBodyMayStandOnItsEnd) {
  const SE3 on_end(expQuaternion({0, -0.5 * M_PI, 0}), Eigen::Vector3d::Zero());
  const SE3 T_first_B(truth_.front().T_W_B.rotation().conjugate() * on_end.rotation(), Eigen::Vector3d::Zero());
  for (StampedPose& pose : truth_) pose.T_W_B = pose.T_W_B * T_first_B;
  EXPECT_NEAR(nees(truth_, draw(1.0)).pose.mean, 6.0, 0.3);
}

/// Without an IMU the world has the first camera's axes, whichever way it looks.
TEST_F(NeesTest, AWorldWithoutAVerticalIsAlignedAsAWhole) {
  auto samples = draw(1.0);
  const SE3 tilted(expQuaternion({0.4, -0.3, 0.2}), Eigen::Vector3d(1, 2, 3));
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = tilted.R();
  for (PoseWithCovariance& sample : samples) {
    sample.T_M_B = tilted * sample.T_M_B;
    sample.covariance = turn * sample.covariance * turn.transpose();
  }
  EXPECT_NEAR(nees(truth_, samples, 0.1, 0, false).pose.mean, 6.0, 0.3);
  EXPECT_GT(nees(truth_, samples).pose.mean, 100.0);
}

TEST_F(NeesTest, OptimisticCovariancesShow) {
  const Nees optimistic = nees(truth_, draw(2.0));
  EXPECT_NEAR(optimistic.pose.mean, 24.0, 1.2);
  EXPECT_LT(optimistic.within_95, 0.3);
}

TEST_F(NeesTest, ZeroCovariancesAreCountedNotJudged) {
  auto samples = draw(1.0);
  for (std::size_t k = 0; k < 10; ++k) samples[100 + k].covariance.setZero();
  const Nees result = nees(truth_, samples);
  EXPECT_EQ(result.unusable, 10u);
  EXPECT_EQ(result.pose.count, samples.size() - 10);
}

}  // namespace
}  // namespace vip_slam
