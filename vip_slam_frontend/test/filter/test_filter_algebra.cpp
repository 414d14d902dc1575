// SPDX-License-Identifier: BSD-3-Clause
// The square-root filter against plain covariance algebra, on random problems with fixed seeds.
#include <random>

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "landmark_simulation.h"
#include "vip_slam_frontend/filter/feature_rows.h"
#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/filter/qr.h"
#include "vip_slam_frontend/filter/square_root_filter.h"
#include "vip_slam_frontend/filter/triangular_solve.h"
#include "vip_slam_frontend/filter/triangulation.h"

namespace vip_slam {
namespace {

Eigen::MatrixXd randomMatrix(int rows, int cols, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  Eigen::MatrixXd m(rows, cols);
  for (int c = 0; c < cols; ++c) {
    for (int r = 0; r < rows; ++r) m(r, c) = normal(random);
  }
  return m;
}

double relative(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return (a - b).norm() / b.norm(); }

TEST(Qr, TriangulariseKeepsTheNormalMatrix) {
  std::mt19937 random(1);
  for (int rows : {5, 12, 40}) {
    Eigen::MatrixXd A = randomMatrix(rows, 9, random);
    const Eigen::MatrixXd normal = A.transpose() * A;
    triangularise(A, std::min(rows, 9));
    EXPECT_LT(relative(A.transpose() * A, normal), 1e-12);
    for (int c = 0; c < 9; ++c) {
      for (int r = c + 1; r < rows; ++r) EXPECT_EQ(A(r, c), 0.0);
      if (c < rows) EXPECT_GE(A(c, c), 0.0);
    }
  }
}

TEST(Qr, RankDeficientColumnsDoNotSpoilTheRest) {
  std::mt19937 random(2);
  Eigen::MatrixXd A = randomMatrix(20, 8, random);
  A.col(3) = A.col(1) + 2.0 * A.col(2);
  const Eigen::MatrixXd normal = A.transpose() * A;
  triangularise(A, 8);
  EXPECT_TRUE(A.allFinite());
  EXPECT_LT(relative(A.transpose() * A, normal), 1e-12);
}

TEST(Qr, StackedUpdateEqualsTheNormalEquations) {
  std::mt19937 random(3);
  const int n = 30, m = 47;
  Eigen::MatrixXd R = randomMatrix(n, n, random).triangularView<Eigen::Upper>();
  R.diagonal().array() += 5.0;
  Eigen::MatrixXd H = randomMatrix(m, n, random);
  Eigen::VectorXd h = randomMatrix(m, 1, random), r = Eigen::VectorXd::Zero(n);
  const Eigen::MatrixXd information = R.transpose() * R + H.transpose() * H;
  const Eigen::VectorXd rhs = H.transpose() * h;
  const double norm = h.squaredNorm();
  stackTriangular(R, r, H, h);
  EXPECT_LT(relative(R.transpose() * R, information), 1e-12);
  EXPECT_LT(relative(R.transpose() * r, rhs), 1e-12);
  EXPECT_NEAR(r.squaredNorm() + h.squaredNorm(), norm, 1e-10 * norm);
}

TEST(Qr, SolveRightIsTheInverse) {
  std::mt19937 random(4);
  Eigen::MatrixXd R = randomMatrix(17, 17, random).triangularView<Eigen::Upper>();
  R.diagonal().array() += 6.0;
  const Eigen::MatrixXd H = randomMatrix(9, 17, random);
  Eigen::MatrixXd Z = H;
  solveRight(R, Z);
  EXPECT_LT(relative(Z * R, H), 1e-12);
}

TEST(Marginalisation, QrEqualsSchur) {
  std::mt19937 random(5);
  const int n = 24, k = 7;
  const Eigen::MatrixXd A = randomMatrix(n + 6, n, random);
  std::vector<int> order = {3, 9, 4, 20, 11, 0, 23};
  for (int c = 0; c < n; ++c) {
    if (std::find(order.begin(), order.begin() + k, c) == order.begin() + k) order.push_back(c);
  }
  const Eigen::MatrixXd R = marginaliseColumns(A, order, k);
  Eigen::MatrixXd L(n, n);
  const Eigen::MatrixXd normal = A.transpose() * A;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) L(i, j) = normal(order[i], order[j]);
  }
  const Eigen::MatrixXd schur =
      L.bottomRightCorner(n - k, n - k) -
      L.bottomLeftCorner(n - k, k) * L.topLeftCorner(k, k).ldlt().solve(L.topRightCorner(k, n - k));
  EXPECT_LT(relative(R.transpose() * R, schur), 1e-12);
}

// Against the textbook: an update whose gain for the considered state is zero, in Joseph's form.
TEST(Marginalisation, AnUpdateTakenBackInOneStateIsTheSchmidtKalmanFilter) {
  std::mt19937 random(8);
  WindowState window;
  window.clones.resize(3);
  window.calibration.depth_offset = window.calibration.time_offset = true;
  const int n = window.dimension(), column = window.timeOffsetColumn(), rows = 12;
  SquareRootFilter filter;
  filter.initialise(window, randomMatrix(n + 20, n, random));
  const Eigen::MatrixXd P = filter.covariance(), H = randomMatrix(rows, n, random);
  const Eigen::VectorXd h = randomMatrix(rows, 1, random);
  const Eigen::MatrixXd S = H * P * H.transpose() + Eigen::MatrixXd::Identity(rows, rows);
  Eigen::MatrixXd K = P * H.transpose() * S.inverse();
  K.row(column).setZero();
  const Eigen::MatrixXd I_KH = Eigen::MatrixXd::Identity(n, n) - K * H;
  const Eigen::MatrixXd expected = I_KH * P * I_KH.transpose() + K * K.transpose();
  Eigen::MatrixXd H_given = H;
  Eigen::VectorXd h_given = h;
  ASSERT_TRUE(filter.update(H_given, h_given).ok);
  filter.consider(column, -filter.window().time_offset, std::sqrt(P(column, column)));
  EXPECT_LT(relative(filter.covariance(), expected), 1e-10);
  EXPECT_TRUE(filter.R().isUpperTriangular(1e-12));
  EXPECT_TRUE(filter.healthy());
  EXPECT_EQ(filter.window().time_offset, 0.0);
  EXPECT_NEAR(filter.window().depth_offset, (K * h)(window.depthOffsetColumn()), 1e-12);
  EXPECT_NEAR(filter.window().v_W.y(), (K * h)(window.navColumn() + 1), 1e-12);
}

TEST(Marginalisation, InflationAddsToTheCovarianceWhatItIsGiven) {
  std::mt19937 random(9);
  WindowState window;
  window.clones.resize(3);
  const int n = window.dimension();
  SquareRootFilter filter;
  filter.initialise(window, randomMatrix(n + 20, n, random));
  const Eigen::MatrixXd P = filter.covariance();
  Eigen::MatrixXd N = randomMatrix(n, 6, random);
  N.col(4).setZero();
  filter.inflate(N);
  EXPECT_LT(relative(filter.covariance(), P + N * N.transpose()), 1e-10);
  EXPECT_TRUE(filter.R().isUpperTriangular(1e-12));
  EXPECT_TRUE(filter.healthy());
}

TEST(Marginalisation, AReplacedMarginalLeavesTheOthersGivenItAsTheyAre) {
  for (const int k : {1, 2}) {
    std::mt19937 random(7);
    WindowState window;
    window.clones.resize(3);
    window.calibration.depth_offset = window.calibration.time_offset = window.calibration.gyro_scale = true;
    const int n = window.dimension(), column = window.timeOffsetColumn();
    SquareRootFilter filter;
    filter.initialise(window, randomMatrix(n + 20, n, random));
    const Eigen::MatrixXd before = filter.covariance(), marginal = before.block(column, column, k, k);
    const Eigen::VectorXd sigmas = 3.0 * marginal.diagonal().cwiseSqrt(), change = Eigen::VectorXd::Constant(k, 1e-3);
    filter.replaceMarginal(column, change, sigmas);
    // P(others given them) stays: P - p M^-1 p^T, with p their columns and M their marginal; then p follows from the
    // new marginal.
    const Eigen::MatrixXd gain = before.middleCols(column, k) * marginal.inverse();
    const Eigen::MatrixXd replaced = Eigen::MatrixXd(sigmas.cwiseAbs2().asDiagonal()) - marginal;
    EXPECT_LT(relative(filter.covariance(), before + gain * replaced * gain.transpose()), 1e-10);
    EXPECT_TRUE(filter.R().isUpperTriangular(1e-12));
    EXPECT_TRUE(filter.healthy());
    const Eigen::VectorXd moved = gain * change;
    EXPECT_NEAR(filter.window().time_offset, change(0), 1e-12);
    EXPECT_NEAR(filter.window().depth_offset, moved(window.depthOffsetColumn()), 1e-12);
    EXPECT_NEAR(filter.window().v_W.y(), moved(window.navColumn() + 1), 1e-12);
  }
}

/// Covariance-form twin: the same state, propagated, cloned, marginalised and updated by the textbook EKF.
struct ReferenceEkf {
  Eigen::MatrixXd P;  // order as in the window
  WindowState window;

  void augment(const Propagation& u, CloneId id, double delay_change) {
    const int n = window.dimension(), clone = window.cloneColumn(static_cast<int>(window.clones.size()) - 1);
    const int calibration = window.calibrationColumn(), nav = window.navColumn();
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(15, n);  // picks (theta, p, v, bg, ba)
    S.block<6, 6>(0, clone).setIdentity();
    S.block<9, 9>(6, nav).setIdentity();
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(n + 6, n);
    J.topLeftCorner(calibration, calibration).setIdentity();
    const Eigen::MatrixXd F = u.Phi * S;
    J.middleRows(calibration, 6) = F.topRows(6);
    J.block(calibration + 6, calibration, nav - calibration, nav - calibration).setIdentity();
    J.bottomRows(9) = F.bottomRows(9);
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(n + 6, 15);
    G.block<6, 6>(calibration, 0).setIdentity();
    G.bottomRightCorner(9, 9).setIdentity();
    P = J * P * J.transpose() + G * u.Q * G.transpose();
    const int delay = window.timeOffsetColumn() + 6;
    P(delay, delay) += delay_change * delay_change;
    Clone c;
    c.id = id;
    c.t = u.predicted.t;
    c.T_W_I = c.T_W_I_fej = u.predicted.T_W_I;
    c.omega_I = u.omega_I;
    c.v_W = u.predicted.v_W;
    c.time_offset = window.time_offset;
    window.clones.push_back(c);
    window.v_W = window.v_W_fej = u.predicted.v_W;
  }
  void marginalise(int index) {
    const int n = window.dimension();
    std::vector<int> keep;
    for (int c = 0; c < n; ++c) {
      if (c / 6 != index || c >= window.calibrationColumn()) keep.push_back(c);
    }
    Eigen::MatrixXd smaller(keep.size(), keep.size());
    for (std::size_t i = 0; i < keep.size(); ++i) {
      for (std::size_t j = 0; j < keep.size(); ++j) smaller(i, j) = P(keep[i], keep[j]);
    }
    P = smaller;
    window.clones.erase(window.clones.begin() + index);
  }
  /// Returns the normalised innovation squared.
  double update(const Eigen::MatrixXd& H, const Eigen::VectorXd& h) {
    const Eigen::MatrixXd S = H * P * H.transpose() + Eigen::MatrixXd::Identity(h.size(), h.size());
    const Eigen::MatrixXd K = P * H.transpose() * S.inverse();
    const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(P.rows(), P.cols()) - K * H;
    P = A * P * A.transpose() + K * K.transpose();
    window.boxplus(K * h);
    return h.dot(S.ldlt().solve(h));
  }
};

class AlgebraOnSimulation : public ::testing::Test {
 protected:
  void SetUp() override {
    options_.seed = 11;
    simulation_ = std::make_unique<testing::LandmarkSimulation>(options_);
    simulation_->generateImu(5.0);
    WindowState window;
    const NavState start = simulation_->stateAt(0.2);
    Clone clone;
    clone.id = 1;
    clone.t = start.t;
    clone.T_W_I = clone.T_W_I_fej = start.T_W_I;
    clone.v_W = start.v_W;
    clone.omega_I = Eigen::Vector3d(0.1, -0.2, 0.3);
    window.clones.push_back(clone);
    window.v_W = window.v_W_fej = start.v_W;
    window.T_I_C = simulation_->T_I_C();
    window.calibration = {true, true, true, true};
    const int n = window.dimension();
    Eigen::VectorXd sigmas = Eigen::VectorXd::Constant(n, 0.02);
    sigmas.head<6>().setConstant(1e-3);
    filter_.initialise(window, sigmas.cwiseInverse().asDiagonal());
    ekf_.window = window;
    ekf_.P = sigmas.cwiseAbs2().asDiagonal();
  }
  void advance(CloneId id, double t) {
    const auto samples = simulation_->imuBetween(filter_.window().clones.back().t, t);
    const Propagation a = propagate(filter_.window(), samples, options_.noise, gravityVector());
    filter_.augment(a, id, 1e-3);
    ekf_.augment(propagate(ekf_.window, samples, options_.noise, gravityVector()), id, 1e-3);
    for (const FilterMeasurement& m : simulation_->sight(t, 60)) {
      tracks_[m.id].push_back({id, m.xy, m.depth, m.depth_sigma});
    }
  }
  testing::SimulationOptions options_;
  std::unique_ptr<testing::LandmarkSimulation> simulation_;
  SquareRootFilter filter_;
  ReferenceEkf ekf_;
  std::map<LandmarkId, std::vector<Observation>> tracks_;
};

TEST_F(AlgebraOnSimulation, EqualsTheReferenceEkf) {
  MeasurementNoise noise;
  noise.sigma_xy = options_.sigma_px / options_.focal;
  CloneId id = 2;
  for (int k = 1; k <= 14; ++k, ++id) {
    advance(id, 0.2 + 0.05 * k);
    const Eigen::MatrixXd predicted = filter_.covariance();
    EXPECT_LT(relative(predicted, ekf_.P), 1e-9);
    if (k % 3 == 0) {
      // Both filters get the same rows, linearised at the filter's window.
      Eigen::MatrixXd H(0, filter_.window().dimension());
      Eigen::VectorXd h(0);
      int used = 0;
      for (auto& track : tracks_) {
        if (track.second.size() < 3 || used == 8) continue;
        const Triangulation point = triangulate(filter_.window(), track.second, noise);
        if (!point.ok) continue;
        const FeatureRows rows = featureRows(filter_.window(), track.second, point.p_W, noise);
        H.conservativeResize(H.rows() + rows.H.rows(), Eigen::NoChange);
        H.bottomRows(rows.H.rows()) = rows.H;
        h.conservativeResize(h.size() + rows.r.size());
        h.tail(rows.r.size()) = rows.r;
        track.second.clear();
        ++used;
      }
      ASSERT_GT(H.rows(), 20);
      const Innovation innovation = testInnovation(filter_.R(), H, h);
      const Eigen::MatrixXd S = H * ekf_.P * H.transpose() + Eigen::MatrixXd::Identity(H.rows(), H.rows());
      const Eigen::VectorXd dx = ekf_.P * H.transpose() * S.ldlt().solve(h);
      const double pull = dx.dot(ekf_.P.ldlt().solve(dx));
      const double expected = double(H.rows()) - S.inverse().trace();
      const double nis = ekf_.update(H, h);
      const UpdateResult result = filter_.update(H, h);
      ASSERT_TRUE(result.ok);
      EXPECT_NEAR(result.nis, nis, 1e-9 * nis);  // |e|^2 is the NIS
      EXPECT_NEAR(innovation.distance, nis, 1e-8 * nis);
      EXPECT_NEAR(innovation.pull, pull, 1e-6 * pull);
      EXPECT_NEAR(innovation.expected_pull, expected, 1e-8 * expected);
    }
    if (filter_.window().clones.size() > 6) {
      const int index = k % 2 == 0 ? 0 : 2;  // the oldest, and one from the middle
      const CloneId gone = filter_.window().clones[index].id;
      filter_.marginalise({index});
      ekf_.marginalise(index);
      for (auto& track : tracks_) {
        auto& list = track.second;
        list.erase(std::remove_if(list.begin(), list.end(), [&](const Observation& o) { return o.clone == gone; }),
                   list.end());
      }
    }
    EXPECT_LT(relative(filter_.covariance(), ekf_.P), 1e-9);
    EXPECT_LT(filter_.window().nav().T_W_I.boxminus(ekf_.window.nav().T_W_I).norm(), 1e-9);
    EXPECT_LT((filter_.window().v_W - ekf_.window.v_W).norm(), 1e-9);
    EXPECT_LT((filter_.window().bias_accel - ekf_.window.bias_accel).norm(), 1e-9);
    EXPECT_NEAR(filter_.window().time_offset, ekf_.window.time_offset, 1e-9);
    EXPECT_LT(relative(filter_.navCovariance().topLeftCorner<6, 6>(),
                       ekf_.P.block<6, 6>(ekf_.window.calibrationColumn() - 6, ekf_.window.calibrationColumn() - 6)),
              1e-9);
  }
}

/// Unobservable directions: three translations and the rotation about the vertical, at the first estimates.
Eigen::MatrixXd nullDirections(const WindowState& window) {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(window.dimension(), 4);
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  for (std::size_t i = 0; i < window.clones.size(); ++i) {
    const int c = window.cloneColumn(static_cast<int>(i));
    const SE3& T = window.clones[i].T_W_I_fej;
    N.block<3, 3>(c + 3, 0).setIdentity();
    N.block<3, 1>(c, 3) = T.R().transpose() * z;
    N.block<3, 1>(c + 3, 3) = z.cross(T.t());
  }
  N.block<3, 1>(window.navColumn(), 3) = z.cross(window.v_W_fej);
  return N;
}

TEST_F(AlgebraOnSimulation, MotionBetweenClonesHasTheJointCovariance) {
  for (int k = 1; k <= 6; ++k) advance(static_cast<CloneId>(k + 1), 0.2 + 0.05 * k);
  const WindowState& window = filter_.window();
  const int a = 1, b = 5;
  // d T_a_b / d(state) by differences, clones perturbed as the window does it.
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, window.dimension());
  constexpr double h = 1e-6;
  for (const int clone : {a, b}) {
    for (int k = 0; k < 6; ++k) {
      const auto motion = [&](double step) {
        SE3 from = window.clones[a].T_W_I, to = window.clones[b].T_W_I;
        (clone == a ? from : to) = window.clones[clone].T_W_I.boxplus(step * Vector6d::Unit(k));
        return from.inverse() * to;
      };
      J.col(window.cloneColumn(clone) + k) = motion(h).boxminus(motion(-h)) / (2 * h);
    }
  }
  const RelativeMotion motion = filter_.relativeMotion(a, b);
  const SE3 expected = window.clones[a].T_W_I.inverse() * window.clones[b].T_W_I;
  EXPECT_LT(motion.T_a_b.boxminus(expected).norm(), 1e-14);
  EXPECT_LT(relative(motion.covariance, J * filter_.covariance() * J.transpose()), 1e-6);
  EXPECT_TRUE(motion.isUsable());
}

TEST_F(AlgebraOnSimulation, UnobservableDirectionsStayUnobservable) {
  MeasurementNoise noise;
  noise.sigma_xy = options_.sigma_px / options_.focal;
  // A prior without information on the four directions: R N = 0 must survive propagation, updates and marginalisation.
  WindowState window = filter_.window();
  const Eigen::MatrixXd N0 =
      nullDirections(window).householderQr().householderQ() * Eigen::MatrixXd::Identity(window.dimension(), 4);
  const Eigen::MatrixXd projector = Eigen::MatrixXd::Identity(N0.rows(), N0.rows()) - N0 * N0.transpose();
  filter_.initialise(window, 50.0 * projector);
  double before = (filter_.R() * nullDirections(filter_.window())).norm();
  EXPECT_LT(before, 1e-8);
  CloneId id = 2;
  int updates = 0;
  for (int k = 1; k <= 12; ++k, ++id) {
    advance(id, 0.2 + 0.05 * k);
    // The estimate moves away from the first estimates, where a filter without FEJ starts to gain information on yaw.
    std::mt19937 random(static_cast<unsigned>(k));
    filter_.window().boxplus(0.005 * randomMatrix(filter_.window().dimension(), 1, random));
    const Eigen::MatrixXd N = nullDirections(filter_.window());
    for (auto& track : tracks_) {
      if (k < 4 || track.second.size() < 4) continue;
      const Triangulation point = triangulate(filter_.window(), track.second, noise);
      if (!point.ok) continue;
      FeatureRows rows = featureRows(filter_.window(), track.second, point.p_W, noise);
      EXPECT_LT((rows.H * N).norm(), 1e-9 * rows.H.norm() * N.norm());
      if (updates < 6) {
        Eigen::MatrixXd H = rows.H;
        Eigen::VectorXd h = 0.0 * rows.r;
        filter_.update(H, h);
        ++updates;
      }
      track.second.clear();
    }
    EXPECT_LT((filter_.R() * N).norm(), 1e-8 * filter_.R().norm());
    if (filter_.window().clones.size() > 6) {
      const CloneId gone = filter_.window().clones.front().id;
      filter_.marginalise({0});
      for (auto& track : tracks_) {
        auto& list = track.second;
        list.erase(std::remove_if(list.begin(), list.end(), [&](const Observation& o) { return o.clone == gone; }),
                   list.end());
      }
      EXPECT_LT((filter_.R() * nullDirections(filter_.window())).norm(), 1e-8 * filter_.R().norm());
    }
  }
  EXPECT_GE(updates, 6);
}

TEST(Gating, QuantilesOfTheChiSquare) {
  // Tables: 0.95 for 1, 5, 30, 100 degrees of freedom.
  EXPECT_NEAR(chiSquareQuantile(0.95, 1), 3.841459, 1e-5);
  EXPECT_NEAR(chiSquareQuantile(0.95, 5), 11.070498, 1e-5);
  EXPECT_NEAR(chiSquareQuantile(0.95, 30), 43.772972, 1e-5);
  EXPECT_NEAR(chiSquareQuantile(0.95, 100), 124.342113, 1e-4);
  EXPECT_NEAR(chiSquareQuantile(0.025, 120), 91.572642, 1e-4);
  const Gate gate(0.95);
  EXPECT_NEAR(gate.threshold(30), 43.772972, 1e-5);
}

}  // namespace
}  // namespace vip_slam
