// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "landmark_simulation.h"
#include "vip_slam_frontend/filter/disputed_motion.h"

namespace vip_slam::frontend {
namespace {

constexpr double kCorrectionStep = 0.05, kCorrection = 1e-3;

/// Corrections of `seconds`, white with kCorrection, plus `bias` each.
DisputedMotion afterCorrections(double seconds, const Vector6d& bias, int seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, kCorrection);
  DisputedMotion disputed;
  for (double t = 0; t < seconds; t += kCorrectionStep) {
    Vector6d correction = bias;
    for (int i = 0; i < 6; ++i) correction(i) += normal(random);
    disputed.add(t, correction, Vector6d::Constant(kCorrection * kCorrection));
  }
  return disputed;
}

TEST(DisputedMotion, WhiteCorrectionsDisputeNoMoreThanChance) {
  double sum = 0, removed = 0;
  for (int seed = 1; seed <= 200; ++seed) {
    sum += afterCorrections(3.0, Vector6d::Zero(), seed).take().sum() / 6;
    removed += kCorrection * kCorrection /
               (1 - std::exp(-2 * kCorrectionStep));  // of a consistent filter, in the steady state
  }
  EXPECT_LT(sum, 0.6 * removed);  // E[max(0, x^2 - 1)] of a standard normal x is 0.48
}

TEST(DisputedMotion, CorrectionsInOneDirectionAreTheirSumAndAreTakenOnce) {
  Vector6d bias = Vector6d::Zero();
  bias(1) = 0.004, bias(3) = -0.002;
  DisputedMotion disputed = afterCorrections(3.0, bias, 1);
  const Vector6d sigma = disputed.take().cwiseSqrt();
  const double intervals = 1 / (1 - std::exp(-kCorrectionStep));  // in a fading memory of a second
  EXPECT_NEAR(sigma(1), 0.004 * intervals, 0.012);
  EXPECT_NEAR(sigma(3), 0.002 * intervals, 0.012);
  EXPECT_LT(sigma(0), 0.012);
  EXPECT_EQ(disputed.take().norm(), 0.0);
}

/// Share of the updates with a significant dispute, and what is taken of axis 0 at those.
struct Taken {
  double share = 0, variance = 0;
};
Taken followed(double seconds, double bias) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, kCorrection);
  DisputedMotion disputed;
  Taken taken;
  for (double t = 0; t < seconds; t += kCorrectionStep) {
    Vector6d correction;
    for (int i = 0; i < 6; ++i) correction(i) = normal(random) + (i == 0 ? bias : 0.0);
    disputed.add(t, correction, Vector6d::Constant(kCorrection * kCorrection));
    if (!disputed.isSignificant()) continue;
    taken.share += kCorrectionStep / seconds;
    taken.variance += disputed.take()(0);
  }
  return taken;
}

TEST(DisputedMotion, WhiteCorrectionsAreHardlyEverSignificant) {
  EXPECT_LT(followed(2000.0, 0.0).share, 1e-3);  // beyond four sigmas: 6 axes at 6.3e-5
}

TEST(DisputedMotion, ADriftIsWithinTwoSigmasOfWhatIsTaken) {
  for (const double seconds : {1.0, 2.0, 4.0}) {
    const double drift = 2e-3 * seconds / kCorrectionStep, sigma = std::sqrt(followed(seconds, 2e-3).variance);
    EXPECT_GT(sigma, drift / 2) << seconds;
    EXPECT_LT(sigma, 1.5 * drift) << seconds;
  }
}

// A gyro that shows a turn for a second, before a camera that stands: nothing says which of them is wrong.
TEST(DisputedMotion, WidensThePositionAndIsNoneWhileTheBodyStands) {
  testing::SimulationOptions options;
  options.speed = 0;
  testing::LandmarkSimulation simulation(options);
  simulation.generateImu(6.0);
  FilterOptions filter_options = testing::singlePixels();
  filter_options.adapt_imu_noise = false;
  VioFilter filter(filter_options, options.noise, simulation.T_I_C(), 0.0, options.focal, 9.81);
  FilterPrior prior;
  prior.state = simulation.stateAt(0.2);
  CloneId id = 1;
  filter.start(prior, id++, Eigen::Vector3d::Zero());
  const auto step = [&](double t, double turn, std::optional<ResidualMotion> still) {
    std::vector<ImuSample> samples = simulation.imuBetween(filter.nav().t, t);
    for (ImuSample& sample : samples) sample.gyro.z() += turn;
    return filter.step(filter.predict(samples), id++, simulation.sight(t, options.most_points), still).disputed;
  };
  const auto sigma = [&] { return std::sqrt(filter.covariance().diagonal().segment<3>(0).maxCoeff()); };
  int disputed = 0;
  double t = 0.2;
  for (int k = 0; k < 40; ++k) disputed += step(t += 0.05, 0.0, std::nullopt);
  EXPECT_EQ(disputed, 0);
  const double before = sigma();
  for (int k = 0; k < 20; ++k) disputed += step(t += 0.05, 0.03, std::nullopt);
  EXPECT_GT(disputed, 5);
  EXPECT_GT(sigma(), 1.5 * before);
  for (int k = 0; k < 20; ++k) EXPECT_FALSE(step(t += 0.05, 0.0, ResidualMotion{0.002, 0.005})) << t;
}

}  // namespace
}  // namespace vip_slam::frontend
