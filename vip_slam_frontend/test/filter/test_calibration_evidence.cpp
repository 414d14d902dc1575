// SPDX-License-Identifier: BSD-3-Clause
// Evidence of a calibration number gathered beside a filter that holds it: against least squares, and what is adopted.
#include "vip_slam_frontend/filter/calibration_evidence.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace vip_slam::frontend {
namespace {

/// Readings of `truth` with this sigma, ten a second; each updates a held state as a filter would.
void addReadings(double truth, double sigma, double from, double to, std::mt19937* random,
                 CalibrationEvidence* evidence, double shared = 0) {
  std::normal_distribution<double> normal;
  double common = 0;
  for (int k = 0; k < 10 * (to - from); ++k) {
    if (k % 20 == 0) common = shared * normal(*random);
    const double t = from + 0.1 * k, z = truth + common + sigma * normal(*random);
    const Estimate held = evidence->held();
    const double information = 1 / (held.sigma * held.sigma) + 1 / (sigma * sigma);
    const Estimate after{(held.value / (held.sigma * held.sigma) + z / (sigma * sigma)) / information,
                         1 / std::sqrt(information)};
    evidence->add(t, learntBetween(held, after));
  }
}

TEST(CalibrationEvidence, EqualsTheMeanOfAllReadingsAndThePrior) {
  CalibrationEvidence evidence({1.0, 0.02});
  const double information = 1 / (0.1 * 0.1);
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const double z = 1.0 + 0.01 * k;
    const Estimate held = evidence.held();
    const double total = 1 / (held.sigma * held.sigma) + information;
    evidence.add(0.1 * k, learntBetween(held, {(held.value / (held.sigma * held.sigma) + z * information) / total,
                                               1 / std::sqrt(total)}));
    sum += information * z;
  }
  const double prior = 1 / (0.02 * 0.02), by = CalibrationEvidence::kUsualScatter;  // one stretch does not show its own
  EXPECT_NEAR(evidence.estimate().value, (sum / by + prior) / (4 * information / by + prior), 1e-12);
  EXPECT_NEAR(evidence.estimate().sigma, 1 / std::sqrt(4 * information / by + prior), 1e-12);
}

TEST(CalibrationEvidence, AdoptsWhatIsSureAndLaterWhatIsSurer) {
  std::mt19937 random(3);
  CalibrationEvidence evidence({1.0, 0.02});
  addReadings(0.97, 0.05, 0, 4, &random, &evidence);
  EXPECT_FALSE(evidence.adopt()) << "two stretches hardly show their scatter";
  int changes = 0;
  for (double t = 4; t < 100; t += 2) {
    addReadings(0.97, 0.05, t, t + 2, &random, &evidence);
    changes += evidence.adopt();
  }
  EXPECT_NEAR(evidence.adopted(), 0.97, 0.006);
  EXPECT_GE(changes, 1);
  EXPECT_LE(changes, 5);
  evidence.reset();
  EXPECT_EQ(evidence.adopted(), 1.0);
  EXPECT_EQ(evidence.estimate().sigma, 0.02);
}

// Errors that all readings of a stretch share do not average out within it.
TEST(CalibrationEvidence, ScatterOfTheStretchesWidensItsSigma) {
  double nees = 0;
  constexpr int kRuns = 50;
  for (int seed = 0; seed < kRuns; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    CalibrationEvidence evidence({1.0, 1.0});
    addReadings(1.0, 0.02, 0, 60, &random, &evidence, 0.02);
    nees += std::pow((evidence.estimate().value - 1) / evidence.estimate().sigma, 2) / kRuns;
  }
  EXPECT_LT(nees, 2.0);  // four times as many without
  EXPECT_GT(nees, 0.4);
}

TEST(CalibrationEvidence, AFilterThatFailedDoesNotSpoilIt) {
  std::mt19937 random(7);
  CalibrationEvidence evidence({1.0, 0.02});
  addReadings(0.97, 0.05, 0, 40, &random, &evidence);
  const Estimate before = evidence.estimate();
  evidence.add(40, learntBetween(evidence.held(), {std::nan(""), std::nan("")}));
  EXPECT_EQ(evidence.estimate().value, before.value);
  EXPECT_EQ(evidence.estimate().sigma, before.sigma);
}

TEST(CalibrationEvidence, RightValuesStay) {
  int adopted = 0;
  for (int seed = 0; seed < 200; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    CalibrationEvidence evidence({1.0, 0.02});
    for (double t = 0; t < 40; t += 2) {
      addReadings(1.0, 0.05, t, t + 2, &random, &evidence);
      adopted += evidence.adopt();
    }
  }
  EXPECT_LE(adopted, 1);
}

TEST(CalibrationEvidence, WhatIsBeyondThePriorIsAnotherFault) {
  std::mt19937 random(5);
  CalibrationEvidence evidence({1.0, 0.02});
  for (double t = 0; t < 40; t += 2) {
    addReadings(0.8, 0.02, t, t + 2, &random, &evidence);
    EXPECT_FALSE(evidence.adopt());
  }
  EXPECT_EQ(evidence.adopted(), 1.0);
}

}  // namespace
}  // namespace vip_slam::frontend
