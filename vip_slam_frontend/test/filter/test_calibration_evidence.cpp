// SPDX-License-Identifier: BSD-3-Clause
// Evidence of a calibration number gathered beside a filter that holds it: against least squares, and what is adopted.
#include "vip_slam_frontend/filter/calibration_evidence.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace vip_slam::frontend {
namespace {

Likelihood readingOf(const Eigen::RowVectorXd& by, double z, double sigma) {
  return {by.transpose() * by / (sigma * sigma), by.transpose() * (z / (sigma * sigma))};
}

/// Readings of `truth` with this sigma, ten a second; the errors of a second have a part in common.
void addReadings(double truth, double sigma, double from, double to, std::mt19937* random,
                 CalibrationEvidence* evidence, double shared = 0) {
  std::normal_distribution<double> normal;
  double common = 0;
  for (int k = 0; k < 10 * (to - from); ++k) {
    if (k % 10 == 0) common = shared * normal(*random);
    const double z = truth + common + sigma * normal(*random);
    evidence->add(from + 0.1 * k, readingOf(Eigen::RowVectorXd::Ones(1), z, sigma));
  }
}

TEST(CalibrationEvidence, EqualsTheMeanOfAllReadingsAndThePrior) {
  CalibrationEvidence evidence({{1.0, 0.02}});
  const double information = 1 / (0.1 * 0.1);
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const double z = 1.0 + 0.01 * k;
    evidence.add(0.1 * k, readingOf(Eigen::RowVectorXd::Ones(1), z, 0.1));
    sum += information * z;
  }
  const double prior = 1 / (0.02 * 0.02), by = CalibrationEvidence::kUsualScatter;  // one stretch does not show its own
  EXPECT_NEAR(evidence.estimate(0).value, (sum / by + prior) / (4 * information / by + prior), 1e-12);
  EXPECT_NEAR(evidence.estimate(0).sigma, 1 / std::sqrt(4 * information / by + prior), 1e-12);
}

// Readings of sums and differences only: least squares of all with the priors, whose numbers are coupled.
TEST(CalibrationEvidence, NumbersThatReadingsMixAreEstimatedTogether) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const std::vector<Estimate> prior = {{1.0, 0.5}, {0.0, 0.2}, {0.0, 0.3}};
  CalibrationEvidence evidence(prior);
  evidence.couple(1, 2, 0.05);
  Eigen::Matrix3d information = Eigen::Vector3d(4.0, 25.0, 1 / 0.09).asDiagonal();
  const Eigen::RowVector3d apart(0, 20, -20);
  information += apart.transpose() * apart;
  Eigen::Vector3d weighted(4.0, 0, 0);
  const Eigen::Vector3d truth(1.2, 0.1, 0.12);
  for (int k = 0; k < 4000; ++k) {
    const Eigen::RowVector3d by(1, normal(random), 0.1 * k / 4000);
    const double z = by * truth + 0.1 * normal(random);
    evidence.add(0.05 * k, readingOf(by, z, 0.1));
    const Likelihood reading = readingOf(by, z, 0.1);
    information += reading.information;
    weighted += reading.weighted;
  }
  const Eigen::Vector3d expected = information.ldlt().solve(weighted);
  const Eigen::Vector3d sigmas = information.inverse().diagonal().cwiseSqrt();
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(evidence.estimate(k).value, expected(k), 0.5 * sigmas(k)) << k;
    EXPECT_NEAR(evidence.estimate(k).sigma, sigmas(k), 0.3 * sigmas(k)) << k;
  }
}

TEST(CalibrationEvidence, WhatIsMarginalisedLeavesWhatReadingsSayOfTheOthers) {
  Likelihood likelihood = Likelihood::none(2);
  likelihood.add(readingOf(Eigen::RowVector2d(1, 1), 3.0, 0.1));
  likelihood.add(readingOf(Eigen::RowVector2d(1, -1), 1.0, 0.2));
  Eigen::Matrix2d joint = likelihood.information;
  joint(1, 1) += 1 / 0.25;
  const Eigen::Vector2d mean = joint.ldlt().solve(likelihood.weighted + Eigen::Vector2d(0, 0.7 / 0.25));
  likelihood.marginalise(1, {0.7, 0.5});
  EXPECT_NEAR(likelihood.information(0, 0), 1 / joint.inverse()(0, 0), 1e-9);
  EXPECT_NEAR(likelihood.weighted(0) / likelihood.information(0, 0), mean(0), 1e-12);
  EXPECT_EQ(likelihood.information(1, 1), 0);
  EXPECT_EQ(likelihood.information(0, 1), 0);
}

TEST(CalibrationEvidence, AdoptsWhatIsSureAndLaterWhatIsSurer) {
  std::mt19937 random(3);
  CalibrationEvidence evidence({{1.0, 0.02}});
  addReadings(0.97, 0.05, 0, 4, &random, &evidence);
  EXPECT_FALSE(evidence.adopt()) << "two stretches hardly show their scatter";
  int changes = 0;
  for (double t = 4; t < 100; t += 2) {
    addReadings(0.97, 0.05, t, t + 2, &random, &evidence);
    changes += evidence.adopt();
  }
  EXPECT_NEAR(evidence.adopted(0), 0.97, 0.006);
  EXPECT_GE(changes, 1);
  EXPECT_LE(changes, 5);
  evidence.restart(0, 0.01);
  EXPECT_EQ(evidence.adopted(0), 1.0);
  EXPECT_NEAR(evidence.estimate(0).sigma, 0.01, 1e-8);
}

// Errors that all readings of a stretch share do not average out within it.
TEST(CalibrationEvidence, ScatterOfTheStretchesWidensItsSigma) {
  double nees = 0;
  constexpr int kRuns = 50;
  for (int seed = 0; seed < kRuns; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    CalibrationEvidence evidence({{1.0, 1.0}});
    addReadings(1.0, 0.02, 0, 60, &random, &evidence, 0.02);
    nees += std::pow((evidence.estimate(0).value - 1) / evidence.estimate(0).sigma, 2) / kRuns;
  }
  EXPECT_LT(nees, 2.0);  // four times as many without
  EXPECT_GT(nees, 0.4);
}

TEST(CalibrationEvidence, AFilterThatFailedDoesNotSpoilIt) {
  std::mt19937 random(7);
  CalibrationEvidence evidence({{1.0, 0.02}});
  addReadings(0.97, 0.05, 0, 40, &random, &evidence);
  const Estimate before = evidence.estimate(0);
  evidence.add(40, readingOf(Eigen::RowVectorXd::Ones(1), std::nan(""), 0.1));
  EXPECT_EQ(evidence.estimate(0).value, before.value);
  EXPECT_EQ(evidence.estimate(0).sigma, before.sigma);
}

// A consider state in the filter makes its update suboptimal: a step may take information away.
TEST(CalibrationEvidence, StepsThatSayLessThanNothingDoNoHarm) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  CalibrationEvidence evidence({{1.0, 0.02}, {0.0, 0.005}});
  for (int k = 0; k < 600; ++k) {
    const Eigen::RowVector2d by(normal(random), normal(random));
    Likelihood step = readingOf(by, by.x() * 1.0, 0.05);
    if (k / 20 % 2 == 1) step = {-1.01 * step.information, -0.9 * step.weighted};  // every other second
    evidence.add(0.05 * k, step);
    evidence.adopt();
    for (int n = 0; n < 2; ++n) {
      ASSERT_TRUE(std::isfinite(evidence.held(n).value) && evidence.held(n).sigma > 0) << k;
      ASSERT_TRUE(std::isfinite(evidence.estimate(n).value) && evidence.estimate(n).sigma > 0) << k;
    }
  }
}

TEST(CalibrationEvidence, RightValuesStay) {
  int adopted = 0;
  for (int seed = 0; seed < 200; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    CalibrationEvidence evidence({{1.0, 0.02}});
    for (double t = 0; t < 40; t += 2) {
      addReadings(1.0, 0.05, t, t + 2, &random, &evidence);
      adopted += evidence.adopt();
    }
  }
  EXPECT_LE(adopted, 1);
}

TEST(CalibrationEvidence, WhatIsBeyondThePriorIsAnotherFault) {
  std::mt19937 random(5);
  CalibrationEvidence evidence({{1.0, 0.02}});
  for (double t = 0; t < 40; t += 2) {
    addReadings(0.8, 0.02, t, t + 2, &random, &evidence);
    EXPECT_FALSE(evidence.adopt());
  }
  EXPECT_EQ(evidence.adopted(0), 1.0);
  EXPECT_TRUE(evidence.contradicts(0));
  EXPECT_NEAR(std::sqrt(evidence.varianceBeyondHeld(0)), 0.2, 0.02);
}

// An hour's evidence is kept in stretches that grow.
TEST(CalibrationEvidence, StaysSmallAndLosesNothing) {
  std::mt19937 random(9);
  CalibrationEvidence evidence({{1.0, 10.0}});
  addReadings(1.0, 0.05, 0, 3600, &random, &evidence);
  EXPECT_NEAR(evidence.estimate(0).sigma, 0.05 / std::sqrt(36000), 0.3 * 0.05 / std::sqrt(36000));
  EXPECT_NEAR(evidence.estimate(0).value, 1.0, 4 * evidence.estimate(0).sigma);
}

}  // namespace
}  // namespace vip_slam::frontend
