// SPDX-License-Identifier: BSD-3-Clause
// Preintegration against exact motion, its Jacobians against central differences, its covariance against Monte Carlo.
#include <gtest/gtest.h>

#include <random>

#include <Eigen/Eigenvalues>

#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_core/testing/analytic_motion.h"
#include "vip_slam_core/testing/numeric_jacobian.h"

namespace vip_slam {
namespace {

using testing::AnalyticMotion;
using testing::numericJacobian;

const Eigen::Vector3d kBg(0.02, -0.01, 0.03), kBa(0.1, 0.2, -0.15);

NavState withBiases(NavState state, const Eigen::Vector3d& bg = kBg, const Eigen::Vector3d& ba = kBa) {
  state.bias_gyro = bg;
  state.bias_accel = ba;
  return state;
}

NavState perturbed(const NavState& s, const Eigen::VectorXd& d) {
  NavState r = s;
  r.T_W_I = s.T_W_I.boxplus(Vector6d(d.head<6>()));
  r.v_W += d.segment<3>(6);
  r.bias_gyro += d.segment<3>(9);
  r.bias_accel += d.segment<3>(12);
  return r;
}

TEST(Preintegration, FollowsExactMotion) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const AnalyticMotion motion(seed, 2.0);
    const Preintegration pre(motion.imu(3.0, 13.0, 200, kBg, kBa), kBg, kBa, ImuNoise());
    EXPECT_NEAR(pre.dt(), 10.0, 1e-9);
    const NavState end = motion.stateAt(13.0),
                   predicted = pre.predict(withBiases(motion.stateAt(3.0)), gravityVector());
    // Ten seconds from noise-free samples at 200 Hz.
    EXPECT_LT((predicted.T_W_I.t() - end.T_W_I.t()).norm(), 1e-3) << seed;
    EXPECT_LT((predicted.v_W - end.v_W).norm(), 2e-4) << seed;
    EXPECT_LT(logSO3(predicted.T_W_I.rotation().conjugate() * end.T_W_I.rotation()).norm(), 1e-5) << seed;
    EXPECT_NEAR(predicted.t, 13.0, 1e-9);
    EXPECT_EQ(predicted.bias_gyro, kBg);
  }
}

TEST(Preintegration, StepsAreExactForSignalsThatChangeLinearly) {
  // Sixteen times as many samples, interpolated, describe the same linear pieces: coning and sculling inside the coarse
  // steps must be accounted for.
  const AnalyticMotion motion(2, 2.0);
  const auto coarse = motion.imu(0, 4, 50);
  std::vector<ImuSample> fine;
  for (std::size_t k = 0; k + 1 < coarse.size(); ++k) {
    for (int s = 0; s < 16; ++s) {
      ImuSample sample;
      const double f = s / 16.0;
      sample.t = (1 - f) * coarse[k].t + f * coarse[k + 1].t;
      sample.gyro = (1 - f) * coarse[k].gyro + f * coarse[k + 1].gyro;
      sample.accel = (1 - f) * coarse[k].accel + f * coarse[k + 1].accel;
      fine.push_back(sample);
    }
  }
  fine.push_back(coarse.back());
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const Preintegration a(coarse, zero, zero, ImuNoise()), b(fine, zero, zero, ImuNoise());
  EXPECT_LT(logSO3(Eigen::Matrix3d(a.deltaR().transpose() * b.deltaR())).norm(), 1e-7);
  EXPECT_LT((a.alpha() - b.alpha()).norm(), 2e-5);
  EXPECT_LT((a.beta() - b.beta()).norm(), 1e-5);
  // The same holds for the covariance: it depends on the duration, not on the number of samples.
  EXPECT_LT((a.covariance() - b.covariance()).norm() / b.covariance().norm(), 0.02);
}

TEST(Preintegration, ResidualVanishesAtTheTruth) {
  const AnalyticMotion motion(4);
  const Preintegration pre(motion.imu(1, 1.5, 400, kBg, kBa), kBg, kBa, ImuNoise());
  const auto r = pre.residual(withBiases(motion.stateAt(1)), withBiases(motion.stateAt(1.5)), gravityVector(), nullptr,
                              nullptr, false);
  EXPECT_LT(r.norm(), 5e-7);
  const NavState i = withBiases(motion.stateAt(1));
  EXPECT_LT(pre.residual(i, pre.predict(i, gravityVector()), gravityVector(), nullptr, nullptr, false).norm(), 1e-12);
}

TEST(Preintegration, JacobiansOfTheResidual) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 10; ++trial) {
    const AnalyticMotion motion(10 + trial);
    const Preintegration pre(motion.imu(1, 1.4, 200, kBg, kBa), kBg, kBa, ImuNoise());
    Eigen::VectorXd offset_i(15), offset_j(15);
    for (int k = 0; k < 15; ++k) offset_i[k] = 0.05 * normal(random), offset_j[k] = 0.05 * normal(random);
    const NavState i = perturbed(withBiases(motion.stateAt(1)), offset_i);
    const NavState j = perturbed(withBiases(motion.stateAt(1.4)), offset_j);
    for (const bool whiten : {false, true}) {
      Matrix15d J_i, J_j;
      pre.residual(i, j, gravityVector(), &J_i, &J_j, whiten);
      const Eigen::MatrixXd N_i = numericJacobian(
          [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
            return pre.residual(perturbed(i, d), j, gravityVector(), nullptr, nullptr, whiten);
          },
          15, 1e-5);
      const Eigen::MatrixXd N_j = numericJacobian(
          [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
            return pre.residual(i, perturbed(j, d), gravityVector(), nullptr, nullptr, whiten);
          },
          15, 1e-5);
      EXPECT_LT((J_i - N_i).cwiseAbs().maxCoeff() / J_i.cwiseAbs().maxCoeff(), 1e-7);
      EXPECT_LT((J_j - N_j).cwiseAbs().maxCoeff() / J_j.cwiseAbs().maxCoeff(), 1e-7);
    }
  }
}

TEST(Preintegration, BiasJacobiansAreThoseOfIntegratingAnew) {
  const AnalyticMotion motion(3, 2.0);
  const auto samples = motion.imu(2, 3, 200, kBg, kBa);
  const Preintegration pre(samples, kBg, kBa, ImuNoise());
  const auto anew = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    const Preintegration moved(samples, kBg + d.head<3>(), kBa + d.tail<3>(), ImuNoise());
    Eigen::VectorXd out(9);
    out << logSO3(Eigen::Matrix3d(pre.deltaR().transpose() * moved.deltaR())), moved.alpha(), moved.beta();
    return out;
  };
  Eigen::MatrixXd analytic = Eigen::MatrixXd::Zero(9, 6);
  analytic << pre.J_theta_bg(), Eigen::Matrix3d::Zero(), pre.J_alpha_bg(), pre.J_alpha_ba(), pre.J_beta_bg(),
      pre.J_beta_ba();
  const Eigen::MatrixXd numeric = numericJacobian(anew, 6, 1e-5);
  EXPECT_LT((analytic - numeric).cwiseAbs().maxCoeff() / numeric.cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Preintegration, BiasCorrectionIsFirstOrder) {
  const AnalyticMotion motion(3);
  const auto samples = motion.imu(2, 2.5, 200);
  const Preintegration at_zero(samples, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), ImuNoise());
  const Eigen::Vector3d bg(0.004, -0.003, 0.002), ba(0.03, 0.02, -0.04);
  const Preintegration anew(samples, bg, ba, ImuNoise());
  const NavState start = withBiases(motion.stateAt(2), bg, ba);
  const NavState corrected = at_zero.predict(start, gravityVector()), exact = anew.predict(start, gravityVector());
  EXPECT_LT(corrected.T_W_I.boxminus(exact.T_W_I).norm(), 5e-5);
  EXPECT_LT((corrected.v_W - exact.v_W).norm(), 5e-5);
  // Without the correction a hundred times as much.
  NavState uncorrected = at_zero.predict(motion.stateAt(2), gravityVector());
  EXPECT_GT((uncorrected.v_W - exact.v_W).norm(), 5e-3);
  EXPECT_FALSE(at_zero.needsReintegration(bg, ba));
  EXPECT_TRUE(at_zero.needsReintegration({0.011, 0, 0}, ba));
  EXPECT_TRUE(at_zero.needsReintegration(bg, {0, 0.11, 0}));
}

// Noise drawn as Kalibr defines its densities must scatter the residual as the covariance says, at any rate.
class MonteCarlo : public ::testing::TestWithParam<double> {};

TEST_P(MonteCarlo, CovarianceMatchesScatter) {
  const double rate = GetParam(), dt = 1.0 / rate, duration = 0.5;
  ImuNoise noise;
  noise.gyro_noise_density = 2e-3;
  noise.accel_noise_density = 2e-2;
  noise.gyro_random_walk = 1e-3;  // large, so that the walk shows in half a second
  noise.accel_random_walk = 2e-2;
  const AnalyticMotion motion(6);
  const auto clean = motion.imu(1, 1 + duration, rate, kBg, kBa);
  const NavState i = withBiases(motion.stateAt(1));
  const Preintegration reference(clean, kBg, kBa, noise);

  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  const int kTrials = rate > 300 ? 1500 : 3000;
  Matrix15d scatter = Matrix15d::Zero();
  double nees = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    auto samples = clean;
    Eigen::Vector3d walk_g = Eigen::Vector3d::Zero(), walk_a = walk_g;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      if (k > 0) {
        walk_g += noise.gyro_random_walk * std::sqrt(dt) * draw();
        walk_a += noise.accel_random_walk * std::sqrt(dt) * draw();
      }
      samples[k].gyro += walk_g + noise.gyro_noise_density / std::sqrt(dt) * draw();
      samples[k].accel += walk_a + noise.accel_noise_density / std::sqrt(dt) * draw();
    }
    const Preintegration measured(samples, kBg, kBa, noise);
    const NavState j = withBiases(motion.stateAt(1 + duration), kBg + walk_g, kBa + walk_a);
    const auto r = measured.residual(i, j, gravityVector(), nullptr, nullptr, false);
    scatter += r * r.transpose() / kTrials;
    nees += measured.residual(i, j, gravityVector()).squaredNorm() / kTrials;
  }
  const Matrix15d& P = reference.covariance();
  for (int k = 0; k < 15; ++k) {
    EXPECT_NEAR(std::sqrt(scatter(k, k) / P(k, k)), 1.0, 0.06) << "row " << k;
  }
  for (int r = 0; r < 15; ++r) {
    for (int c = 0; c < r; ++c) {
      const double scale = std::sqrt(P(r, r) * P(c, c));
      EXPECT_NEAR(scatter(r, c) / scale, P(r, c) / scale, 0.09) << r << " " << c;
    }
  }
  EXPECT_NEAR(nees, 15.0, 0.9);
}
INSTANTIATE_TEST_SUITE_P(Rates, MonteCarlo, ::testing::Values(100.0, 200.0, 400.0));

TEST(Preintegration, WhiteningIsUpperTriangularAndInvertsTheCovariance) {
  const AnalyticMotion motion(8);
  const Preintegration pre(motion.imu(0, 0.2, 200), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), ImuNoise());
  const Matrix15d& W = pre.sqrtInformation();
  EXPECT_EQ(W.triangularView<Eigen::StrictlyLower>().toDenseMatrix().norm(), 0);
  EXPECT_LT((W * pre.covariance() * W.transpose() - Matrix15d::Identity()).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Preintegration, ASingleStepHasAnInverse) {
  // Between two images within a gap of the IMU there is the line from one sample to the next, nothing else.
  for (const double dt : {1e-3, 0.05, 1.0}) {
    const std::vector<ImuSample> step = {{5.0, Eigen::Vector3d(0.3, -0.2, 0.5), Eigen::Vector3d(0.5, 1, 9.6)},
                                         {5.0 + dt, Eigen::Vector3d(-0.1, 0.4, 0.2), Eigen::Vector3d(-1, 0.2, 9.9)}};
    std::vector<ImuSample> fine;
    for (int k = 0; k <= 16; ++k) {
      const double f = k / 16.0;
      fine.push_back(
          {5.0 + f * dt, (1 - f) * step[0].gyro + f * step[1].gyro, (1 - f) * step[0].accel + f * step[1].accel});
    }
    const Preintegration pre(step, kBg, kBa, ImuNoise()), exact(fine, kBg, kBa, ImuNoise());
    const Matrix15d& W = pre.sqrtInformation();
    EXPECT_LT((W * pre.covariance() * W.transpose() - Matrix15d::Identity()).cwiseAbs().maxCoeff(), 1e-6) << dt;
    EXPECT_NEAR(pre.dt(), dt, 1e-12);
    // One long step has the same covariance as many short ones: each, whitened by the other, is close to unity.
    const Matrix15d relative = exact.sqrtInformation() * pre.covariance() * exact.sqrtInformation().transpose();
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix15d>(relative).eigenvalues().minCoeff(), 0.5) << dt;
    EXPECT_LT(Eigen::SelfAdjointEigenSolver<Matrix15d>(relative).eigenvalues().maxCoeff(), 1.5) << dt;
    EXPECT_LT((pre.beta() - exact.beta()).norm(), 2e-2 * dt) << dt;
    EXPECT_LT((pre.alpha() - exact.alpha()).norm(), 2e-2 * dt) << dt;
  }
}

TEST(Preintegration, BadInput) {
  const AnalyticMotion motion(1);
  auto samples = motion.imu(0, 1, 100);
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  EXPECT_THROW(Preintegration({}, zero, zero, ImuNoise()), std::invalid_argument);
  EXPECT_THROW(Preintegration({samples[0]}, zero, zero, ImuNoise()), std::invalid_argument);
  std::swap(samples[3], samples[4]);
  EXPECT_THROW(Preintegration(samples, zero, zero, ImuNoise()), std::invalid_argument);
  samples = motion.imu(0, 1, 100);
  samples[4].t = samples[3].t;
  EXPECT_THROW(Preintegration(samples, zero, zero, ImuNoise()), std::invalid_argument);
}

TEST(AnalyticMotionTest, DerivativesAreExact) {
  const AnalyticMotion motion(9, 1.5);
  const double h = 1e-5;
  for (double t = 0.5; t < 5; t += 0.7) {
    const NavState before = motion.stateAt(t - h), now = motion.stateAt(t), after = motion.stateAt(t + h);
    const ImuSample imu = motion.imuAt(t);
    EXPECT_LT(((after.T_W_I.t() - before.T_W_I.t()) / (2 * h) - now.v_W).norm(), 1e-8);
    const Eigen::Vector3d a = (after.v_W - before.v_W) / (2 * h);
    EXPECT_LT((now.T_W_I.rotation() * imu.accel - a - gravityVector()).norm(), 1e-7);
    const Eigen::Vector3d w = logSO3(before.T_W_I.rotation().conjugate() * after.T_W_I.rotation()) / (2 * h);
    EXPECT_LT((w - imu.gyro).norm(), 1e-8);
  }
}

}  // namespace
}  // namespace vip_slam
