// SPDX-License-Identifier: BSD-3-Clause
// Rows from flat surfaces: Jacobians, unobservable directions, and the association of the pairs.
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <opencv2/core.hpp>

#include "test_camera.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_frontend/filter/square_root_filter.h"
#include "vip_slam_frontend/filter/surface_rows.h"
#include "vip_slam_frontend/filter/triangulation.h"
#include "vip_slam_frontend/tracking/surface_tracker.h"

namespace vip_slam {
namespace {

Eigen::Vector3d gauss(std::mt19937* random, double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  return {normal(*random), normal(*random), normal(*random)};
}

WindowState makeWindow(unsigned seed, const CalibrationFlags& calibration) {
  std::mt19937 random(seed);
  WindowState window;
  for (int i = 0; i < 4; ++i) {
    Clone clone;
    clone.id = 10 + i;
    clone.T_W_I =
        SE3(expSO3(Eigen::Vector3d(gauss(&random, 0.1))), Eigen::Vector3d(0.1 * i, 0, 1) + gauss(&random, 0.05));
    clone.T_W_I_fej = clone.T_W_I;
    clone.omega_I = gauss(&random, 0.5);
    clone.v_W = gauss(&random, 0.5);
    window.clones.push_back(clone);
  }
  window.T_I_C = SE3(expSO3(Eigen::Vector3d(gauss(&random, 0.3))), gauss(&random, 0.05));
  window.calibration = calibration;
  return window;
}

/// Pairs on `planes` random planes round the camera; residuals of a few sigmas.
SurfaceMatches makeMatches(const WindowState& window, unsigned seed, const std::vector<Eigen::Vector3d>& normals_W,
                           double error) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  const SE3 T_W_ref = cameraPose(window, window.clones[1]), T_W_cur = cameraPose(window, window.clones.back());
  SurfaceMatches matches;
  matches.reference = window.clones[1].id;
  for (int i = 0; i < 120; ++i) {
    const Eigen::Vector3d n_W = normals_W[i % normals_W.size()];
    // On the plane n^T x = 2, somewhere around its foot point.
    SurfacePair pair;
    do {
      Eigen::Vector3d x_W = gauss(&random, 1.0);
      x_W += (2.0 - n_W.dot(x_W)) * n_W;
      Eigen::Vector3d y_W = x_W + gauss(&random, 0.03);
      y_W += (2.0 - n_W.dot(y_W) + error * normal(random)) * n_W;
      pair.p_ref = T_W_ref.inverse() * x_W;
      pair.n_ref = T_W_ref.R().transpose() * n_W;
      pair.q_cur = T_W_cur.inverse() * y_W;
    } while (std::abs(pair.p_ref.z()) < 0.3 || std::abs(pair.q_cur.z()) < 0.3);  // rays have a z of 1
    pair.sigma = 0.01;
    pair.surface = static_cast<int>(i % normals_W.size());
    matches.pairs.push_back(pair);
  }
  return matches;
}

double cost(const WindowState& window, const SurfaceMatches& matches) {
  WindowState of_depth = window;  // whose images are older
  of_depth.time_offset -= window.depth_delay;
  const SE3 T_ref_cur = cameraPose(of_depth, window.clones[window.indexOf(matches.reference)]).inverse() *
                        cameraPose(of_depth, window.clones.back());
  double sum = 0;
  for (const SurfacePair& pair : matches.pairs) {
    Eigen::Matrix3d bearing = window.bearing.matrix();
    bearing.col(2).head<2>() -= window.depth_shift;
    const Eigen::Vector3d q = bearing * (window.trueDepth(pair.q_cur.z()) / pair.q_cur.z() * pair.q_cur);
    const Eigen::Vector3d p = bearing * (window.trueDepth(pair.p_ref.z()) / pair.p_ref.z() * pair.p_ref);
    // Two directions in the patch, after the bearing correction, span the plane of its points.
    const Eigen::Vector3d along = bearing * pair.n_ref.unitOrthogonal();
    const Eigen::Vector3d across = bearing * pair.n_ref.cross(pair.n_ref.unitOrthogonal());
    const double r = along.cross(across).normalized().dot(T_ref_cur * q - p) / pair.sigma;
    sum += 0.5 * r * r;
  }
  return sum;
}

const std::vector<Eigen::Vector3d> kRoom{Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), -Eigen::Vector3d::UnitY(),
                                         -Eigen::Vector3d::UnitZ(), Eigen::Vector3d(0.6, 0.8, 0)};
const std::vector<Eigen::Vector3d> kCorridor{Eigen::Vector3d::UnitY(), -Eigen::Vector3d::UnitY(),
                                             -Eigen::Vector3d::UnitZ()};

TEST(SurfaceRows, GradientEqualsDifferencesInEveryColumn) {
  const CalibrationFlags all{true, true, true, true, true, true, true, true, true, true, true},
      shift{false, false, false, false, false, false, false, false, true};
  for (const CalibrationFlags& calibration : {CalibrationFlags(), all, shift}) {
    WindowState window = makeWindow(3, calibration);
    const bool calibrated = calibration.rotation;
    if (calibrated) window.bearing.value << 0.003, -0.002, 0.001, -0.0015;
    if (calibration.depth_shift) window.depth_shift << 0.004, -0.003;
    window.depth_offset = calibrated ? 0.002 : 0;
    const SurfaceMatches matches = makeMatches(window, 4, kRoom, 0.01);
    const int n = window.dimension();
    // A weak prior, so that nothing is gated or weighted down.
    const Eigen::MatrixXd R = 1e-3 * Eigen::MatrixXd::Identity(n, n);
    const SurfaceRows rows = surfaceRows(window, R, matches, 100.0);
    ASSERT_EQ(rows.used, 120);
    ASSERT_EQ(rows.rows.H.rows(), 6 + window.calibration.camera());
    const Eigen::VectorXd gradient = -rows.rows.H.transpose() * rows.rows.r;
    EXPECT_GT(gradient.norm(), 1.0);
    double by_offset = 0;
    for (int c = 0; c < n; ++c) {
      const double h = 1e-6;
      Eigen::VectorXd delta = Eigen::VectorXd::Zero(n);
      WindowState plus = window, minus = window;
      delta(c) = h;
      plus.boxplus(delta);
      minus.boxplus(-delta);
      const double numeric = (cost(plus, matches) - cost(minus, matches)) / (2 * h);
      if (calibration.depth_offset && c == window.depthOffsetColumn()) by_offset = numeric;
      // The scale's column has the predicted distance between the planes in place of the measured one, which differs
      // from it by the residual.
      const bool scale = calibration.depth_scale && c == window.depthScaleColumn();
      const double expected = scale ? numeric - 2 * cost(window, matches) + window.depth_offset * by_offset : numeric;
      EXPECT_NEAR(gradient(c), expected, 1e-5 * std::max(1.0, gradient.norm())) << "column " << c;
    }
  }
}

TEST(SurfaceRows, FewerPairsThanStatesAreARowEach) {
  const CalibrationFlags all{true, true, true, true, true, true, true, true, true, true, true};
  const WindowState window = makeWindow(3, all);
  SurfaceMatches matches = makeMatches(window, 4, kRoom, 0.01);
  matches.pairs.resize(20);
  const int n = window.dimension();
  const SurfaceRows rows = surfaceRows(window, 1e-3 * Eigen::MatrixXd::Identity(n, n), matches, 100.0);
  ASSERT_EQ(rows.used, 20);
  ASSERT_LT(rows.used, 6 + window.calibration.camera());
  ASSERT_EQ(rows.rows.H.rows(), rows.used);
  EXPECT_NEAR(0.5 * rows.rows.r.squaredNorm(), cost(window, matches), 1e-9 * cost(window, matches));
}

/// Information of the rows on the newest pose, given all others.
Eigen::Matrix<double, 6, 6> informationOnNewest(const WindowState& window, const SurfaceMatches& matches) {
  const int n = window.dimension();
  const SurfaceRows rows = surfaceRows(window, 1e-3 * Eigen::MatrixXd::Identity(n, n), matches, 100.0);
  const Eigen::MatrixXd H = rows.rows.H.middleCols<6>(window.cloneColumn(static_cast<int>(window.clones.size()) - 1));
  return H.transpose() * H;
}

TEST(SurfaceRows, WhiteAndSharedNoiseEqualTheDenseCovariance) {
  const WindowState window = makeWindow(31, {});
  const int newest = window.cloneColumn(3);
  for (const double shared : {0.0, 0.003, 0.05}) {
    SurfaceMatches matches = makeMatches(window, 32, kRoom, 0.005);
    for (SurfacePair& pair : matches.pairs) pair.sigma = 0.005 + 0.001 * std::abs(pair.q_cur.z()), pair.shared = shared;
    // Row by row, from runs in which a single pair is exact and all others say nothing.
    const int m = static_cast<int>(matches.pairs.size());
    const int n = window.dimension();
    Eigen::MatrixXd H(m, 6);
    Eigen::VectorXd r(m);
    for (int i = 0; i < m; ++i) {
      SurfaceMatches one = matches;
      for (SurfacePair& pair : one.pairs) pair.sigma = 1e9, pair.shared = 0;
      one.pairs[i].sigma = 1;
      const SurfaceRows rows = surfaceRows(window, 1e-3 * Eigen::MatrixXd::Identity(n, n), one, 1e9);
      // All but one direction of the compressed rows is empty.
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows.rows.H, Eigen::ComputeThinU);
      H.row(i) = svd.matrixU().col(0).transpose() * rows.rows.H.middleCols<6>(newest);
      r(i) = svd.matrixU().col(0).dot(rows.rows.r);
    }
    // The residual's sign is that of its row, which the singular vectors leave open.
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(m, m);
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < m; ++j) {
        const SurfacePair &a = matches.pairs[i], &b = matches.pairs[j];
        const double apart = std::hypot(a.p_ref.x() / a.p_ref.z() - b.p_ref.x() / b.p_ref.z(),
                                        a.p_ref.y() / a.p_ref.z() - b.p_ref.y() / b.p_ref.z());
        if (a.surface == b.surface) covariance(i, j) = shared * shared * std::exp(-apart / 0.12);
      }
    }
    // Signs: the row of a pair is n_ref^T R_ref_cur (...) in the position; fix them by the reference's normal.
    for (int i = 0; i < m; ++i) {
      const SE3 T_W_ref = cameraPose(window, window.clones[1]);
      const Eigen::Vector3d n_W = T_W_ref.R() * matches.pairs[i].n_ref;
      if (n_W.dot(H.row(i).tail<3>()) < 0) H.row(i) *= -1, r(i) *= -1;
      covariance(i, i) += matches.pairs[i].sigma * matches.pairs[i].sigma;
    }
    const Eigen::MatrixXd inverse = covariance.inverse();
    const Eigen::MatrixXd expected = H.transpose() * inverse * H;
    EXPECT_LT((informationOnNewest(window, matches) - expected).norm(), 1e-6 * expected.norm()) << shared;
    const SurfaceRows rows = surfaceRows(window, 1e-3 * Eigen::MatrixXd::Identity(n, n), matches, 1e9);
    const Eigen::VectorXd gradient = rows.rows.H.middleCols<6>(newest).transpose() * rows.rows.r;
    EXPECT_LT((gradient - H.transpose() * inverse * r).norm(), 1e-6 * gradient.norm()) << shared;
  }
}

// A wall straight ahead: its distance is never known better than what its readings share.
TEST(SurfaceRows, CorrelatedReadingsAreNotWorthTheirNumber) {
  WindowState window = makeWindow(33, {});
  for (Clone& clone : window.clones) clone.T_W_I = clone.T_W_I_fej = SE3();
  window.T_I_C = SE3();
  const auto sigmaOfDistance = [&](int side, double half, double shared) {
    SurfaceMatches matches;
    matches.reference = window.clones[1].id;
    for (int i = 0; i < side * side; ++i) {
      SurfacePair pair;
      const double x = 2.0 * (i % side) / (side - 1) - 1.0, y = 2.0 * (i / side) / (side - 1) - 1.0;
      pair.p_ref = pair.q_cur = {half * x, half * y, 2.0};
      pair.n_ref = -Eigen::Vector3d::UnitZ();
      pair.sigma = 0.01;
      pair.shared = shared;
      matches.pairs.push_back(pair);
    }
    return 1.0 / std::sqrt(informationOnNewest(window, matches)(5, 5));
  };
  EXPECT_NEAR(sigmaOfDistance(8, 1.0, 0), 0.01 / 8, 1e-9);
  EXPECT_NEAR(sigmaOfDistance(16, 1.0, 0), 0.01 / 16, 1e-9);
  // Much smaller than the correlation reaches: one shared error.
  EXPECT_NEAR(sigmaOfDistance(8, 0.001, 0.004), std::hypot(0.004, 0.01 / 8), 1e-5);
  EXPECT_NEAR(sigmaOfDistance(16, 0.001, 0.004), std::hypot(0.004, 0.01 / 16), 1e-5);
  // Four times the readings of a wall are worth hardly more, a wall of four times the area is.
  EXPECT_GT(sigmaOfDistance(16, 1.0, 0.02), 0.9 * sigmaOfDistance(8, 1.0, 0.02));
  EXPECT_LT(sigmaOfDistance(16, 1.0, 0.02), 0.7 * sigmaOfDistance(16, 0.5, 0.02));
}

TEST(SurfaceRows, PositionAndYawStayUnobservable) {
  WindowState window = makeWindow(5, {});
  // Estimates that have moved away from their first ones.
  std::mt19937 random(6);
  for (Clone& clone : window.clones) clone.T_W_I.t() += gauss(&random, 0.01);
  const SurfaceMatches matches = makeMatches(window, 7, kRoom, 0.01);
  const int n = window.dimension();
  const SurfaceRows rows = surfaceRows(window, 1e-3 * Eigen::MatrixXd::Identity(n, n), matches, 100.0);
  ASSERT_GT(rows.used, 100);
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(n, 4);
  for (std::size_t i = 0; i < window.clones.size(); ++i) {
    const int c = window.cloneColumn(static_cast<int>(i));
    const SE3& fej = window.clones[i].T_W_I_fej;
    N.block<3, 3>(c + 3, 0).setIdentity();
    N.block<3, 1>(c, 3) = fej.R().transpose() * Eigen::Vector3d::UnitZ();
    N.block<3, 1>(c + 3, 3) = Eigen::Vector3d::UnitZ().cross(fej.t());
  }
  EXPECT_LT((rows.rows.H * N).norm(), 1e-8 * rows.rows.H.norm());
}

TEST(SurfaceRows, ACorridorHoldsAllButItsAxis) {
  const WindowState window = makeWindow(8, {});
  const SurfaceMatches matches = makeMatches(window, 9, kCorridor, 0.0);
  const int n = window.dimension(), newest = window.cloneColumn(3);
  const SurfaceRows rows = surfaceRows(window, 1e-3 * Eigen::MatrixXd::Identity(n, n), matches, 100.0);
  const Eigen::MatrixXd H = rows.rows.H.middleCols(newest, 6);
  const Eigen::Matrix<double, 6, 6> information = H.transpose() * H;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(information);
  EXPECT_LT(solver.eigenvalues()(0), 1e-9 * solver.eigenvalues()(5));
  EXPECT_GT(solver.eigenvalues()(1), 1e-4 * solver.eigenvalues()(5));
  EXPECT_NEAR(std::abs(solver.eigenvectors()(3, 0)), 1.0, 1e-6);  // the axis is x
}

TEST(SurfaceRows, AnUpdateBringsTheNewestPoseBackAndOtherSurfacesAreGated) {
  const WindowState truth = makeWindow(10, {});
  SurfaceMatches matches = makeMatches(truth, 11, kRoom, 0.0);
  // One pair in six lies on something else: a door leaf 15 cm behind the wall.
  for (std::size_t i = 0; i < matches.pairs.size(); i += 6) matches.pairs[i].p_ref += 0.15 * matches.pairs[i].n_ref;
  WindowState guess = truth;
  const Vector6d error = (Vector6d() << 0.004, -0.003, 0.005, 0.01, -0.015, 0.012).finished();
  guess.clones.back().T_W_I = guess.clones.back().T_W_I_fej = truth.clones.back().T_W_I.boxplus(error);
  const int n = guess.dimension();
  Eigen::MatrixXd prior = 1e4 * Eigen::MatrixXd::Identity(n, n);
  prior.block<3, 3>(guess.cloneColumn(3), guess.cloneColumn(3)).diagonal().setConstant(1.0 / 0.005);
  prior.block<3, 3>(guess.cloneColumn(3) + 3, guess.cloneColumn(3) + 3).diagonal().setConstant(1.0 / 0.02);
  SquareRootFilter filter;
  filter.initialise(guess, prior);
  SurfaceRows rows = surfaceRows(filter.window(), filter.R(), matches, 1.5);
  EXPECT_EQ(rows.gated, 20);
  EXPECT_EQ(rows.used, 100);
  ASSERT_TRUE(filter.update(rows.rows.H, rows.rows.r).ok);
  const SE3 left = truth.clones.back().T_W_I.inverse() * filter.window().clones.back().T_W_I;
  EXPECT_LT(left.t().norm(), 0.002);
  EXPECT_LT(logSO3(left.rotation()).norm(), 0.002);
}

TEST(SurfaceRows, NothingFromFewPairsOrAForgottenReference) {
  const WindowState window = makeWindow(12, {});
  SurfaceMatches matches = makeMatches(window, 13, kRoom, 0.0);
  const int n = window.dimension();
  const Eigen::MatrixXd R = Eigen::MatrixXd::Identity(n, n);
  matches.reference = 99;
  EXPECT_EQ(surfaceRows(window, R, matches, 1.5).rows.r.size(), 0);
  matches.reference = window.clones.back().id;  // matched with itself
  EXPECT_EQ(surfaceRows(window, R, matches, 1.5).rows.r.size(), 0);
  matches.reference = window.clones.front().id;
  matches.pairs.resize(10);
  EXPECT_EQ(surfaceRows(window, R, matches, 1.5).rows.r.size(), 0);
}

// ---- association ----

constexpr double kLongFocal = 480;
constexpr int kWindow = 11;

std::shared_ptr<const CameraModel> camera() { return testCamera(kLongFocal); }

/// A corridor 2.2 m wide and 2.8 m high with an end wall 6 m ahead, seen by a camera at `T_W_C` (world: x right, y
/// down, z ahead).
cv::Mat corridor(const SE3& T_W_C, const DepthNoise& noise, unsigned seed) {
  struct Wall {
    Eigen::Vector3d n;
    double d;
  };
  const std::vector<Wall> walls{{Eigen::Vector3d::UnitX(), 1.1},
                                {-Eigen::Vector3d::UnitX(), 1.1},
                                {Eigen::Vector3d::UnitY(), 1.5},
                                {-Eigen::Vector3d::UnitY(), 1.3},
                                {Eigen::Vector3d::UnitZ(), 6.0}};
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  cv::Mat_<float> depth(480, 640);
  const Eigen::Matrix3d R = T_W_C.R();
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const Eigen::Vector3d ray = R * Eigen::Vector3d((u - kCx) / kLongFocal, (v - kCy) / kLongFocal, 1);
      double z = 1e9;
      for (const Wall& wall : walls) {
        const double towards = wall.n.dot(ray);
        if (towards > 1e-9) z = std::min(z, (wall.d - wall.n.dot(T_W_C.t())) / towards);
      }
      depth(v, u) = static_cast<float>(z + noise.sigma(z) * normal(random));
    }
  }
  return depth;
}

TEST(SurfaceTracker, PatchesLieOnTheWallsAndMatchesAgreeWithTheMotion) {
  const DepthNoise noise;
  SurfaceTracker tracker(camera(), noise, kWindow);
  const SE3 T_W_ref(expSO3(Eigen::Vector3d(0.02, -0.03, 0.01)), Eigen::Vector3d(0.1, 0, 0));
  const SE3 T_W_cur = T_W_ref * SE3(expSO3(Eigen::Vector3d(0.01, 0.06, -0.02)), Eigen::Vector3d(0.03, -0.02, 0.25));
  const cv::Mat reference = corridor(T_W_ref, noise, 1);
  int tilted = 0;
  for (const SurfacePatch& patch : tracker.patches(reference)) {
    const Eigen::Vector3d n_W = T_W_ref.R() * patch.n_C;
    // At worst the window contains a little of the adjacent wall.
    EXPECT_GT(n_W.cwiseAbs().maxCoeff(), std::cos(6.0 * kDegree));
    tilted += n_W.cwiseAbs().maxCoeff() < std::cos(2.0 * kDegree);
    EXPECT_LT(patch.n_C.dot(patch.p_C), 0.0);  // towards the camera
  }
  EXPECT_EQ(tracker.reference(), 0u);
  tracker.setReference(reference, 7);
  EXPECT_EQ(tracker.reference(), 7u);
  EXPECT_LT(tilted, 0.1 * tracker.size());
  ASSERT_GT(tracker.size(), 120u);
  const SurfaceMatches matches = tracker.match(corridor(T_W_cur, noise, 2), T_W_cur.inverse() * T_W_ref);
  EXPECT_EQ(matches.reference, 7u);
  ASSERT_GT(matches.pairs.size(), 90u);
  const SE3 T_ref_cur = T_W_ref.inverse() * T_W_cur;
  double sum = 0;
  int beyond = 0;
  for (const SurfacePair& pair : matches.pairs) {
    const double e = pair.n_ref.dot(T_ref_cur * pair.q_cur - pair.p_ref) / pair.sigma;
    sum += std::min(9.0, e * e);
    beyond += std::abs(e) > 4;
  }
  EXPECT_LT(std::sqrt(sum / matches.pairs.size()), 1.0);  // sigma must not be too small
  EXPECT_LT(beyond, 0.05 * matches.pairs.size());         // at room corners: adjacent wall
  tracker.clear();
  EXPECT_EQ(tracker.match(reference, SE3()).pairs.size(), 0u);
}

/// Information on the newest position along the unit vector `along` (world), its other poses given.
double informationAlong(const SurfaceMatches& matches, const Eigen::Vector3d& along) {
  WindowState window = makeWindow(14, {});
  for (Clone& clone : window.clones) clone.T_W_I = clone.T_W_I_fej = SE3();
  window.T_I_C = SE3();
  SurfaceMatches of_window = matches;
  of_window.reference = window.clones[1].id;
  const int n = window.dimension();
  const SurfaceRows rows = surfaceRows(window, 1e-3 * Eigen::MatrixXd::Identity(n, n), of_window, 1.5);
  return (rows.rows.H.middleCols<3>(window.cloneColumn(3) + 3) * along).squaredNorm();
}

// A floor and a ceiling through a fisheye: when fitted in its pixels, patches are off by up to 6 mm at the rim,
// depending on distance, which looks like a depth offset.
TEST(SurfaceTracker, PatchesOfAFisheyeLieOnTheirPlanes) {
  CameraIntrinsics k;
  k.width = 640, k.height = 480;
  k.fx = k.fy = 290;
  k.cx = 319.5, k.cy = 239.5;
  k.model = DistortionModel::kEquidistant;
  k.distortion = {0.01, -0.004, 0, 0};
  const std::shared_ptr<const CameraModel> fisheye = makeCamera(k);
  DepthNoise noise;
  cv::Mat depth(k.height, k.width, CV_32FC1, cv::Scalar(0));
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      Eigen::Vector2d xy;
      if (fisheye->undistort(Eigen::Vector2d(u, v), &xy) && std::abs(xy.y()) > 0.2) {
        depth.at<float>(v, u) = static_cast<float>(1.4 / std::abs(xy.y()));
      }
    }
  }
  int rim = 0;
  for (const SurfacePatch& patch : SurfaceTracker(fisheye, noise, kWindow).patches(depth)) {
    EXPECT_NEAR(std::abs(patch.p_C.y()), 1.4, 1e-4) << patch.p_C.transpose();
    EXPECT_GT(std::abs(patch.n_C.y()), std::cos(1e-3)) << patch.p_C.transpose();
    rim += patch.p_C.head<2>().norm() > patch.p_C.z();
  }
  EXPECT_GT(rim, 30);
}

TEST(SurfaceTracker, ABareWallSaysNothingOfMotionAlongIt) {
  const DepthNoise noise;
  SurfaceTracker tracker(camera(), noise, kWindow);
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, 1);
  const auto wall = [&] {
    cv::Mat_<float> depth(480, 640);
    for (float& z : depth) z = static_cast<float>(1.5 + noise.sigma(1.5) * normal(random));
    return cv::Mat(depth);
  };
  tracker.setReference(wall(), 3);
  ASSERT_GT(tracker.size(), 200u);
  double across = 0, along = 0;
  for (int i = 0; i < 100; ++i) {  // a few seconds at rest in front of it
    const SurfaceMatches matches = tracker.match(wall(), SE3());
    across += informationAlong(matches, Eigen::Vector3d::UnitZ());
    along += informationAlong(matches, Eigen::Vector3d::UnitX());
  }
  EXPECT_LT(1.0 / std::sqrt(across), 5e-4);  // all images share the one reference's errors
  EXPECT_GT(1.0 / std::sqrt(along), 0.1);
}

TEST(PatchGrouping, PatchesOfTheSameWallShareOneNormalAndLonersGo) {
  const DepthNoise noise;
  SurfaceTracker tracker(camera(), noise, kWindow);
  const SE3 T_W_ref(expSO3(Eigen::Vector3d(0.02, -0.03, 0.01)), Eigen::Vector3d(0.1, 0, 0));
  std::vector<SurfacePatch> patches = tracker.patches(corridor(T_W_ref, noise, 5));
  const std::size_t on_walls = patches.size();
  SurfacePatch loner = patches.front();
  loner.n_C = Eigen::Vector3d(0.6, 0.0, -0.8);
  loner.p_C = Eigen::Vector3d(0, 0, 2);
  patches.push_back(loner);
  const std::vector<SurfacePatch> shared = shareNormals(patches);
  EXPECT_LE(shared.size(), on_walls);
  EXPECT_GT(shared.size(), on_walls * 8 / 10);
  for (const SurfacePatch& patch : shared) {
    EXPECT_GT((T_W_ref.R() * patch.n_C).cwiseAbs().maxCoeff(), std::cos(0.3 * kDegree));
    EXPECT_GT((patch.p_C - loner.p_C).norm(), 1e-9);
  }
}

// A door leaf set back by 12 cm: a plane that leans across the step fits stripes of both surfaces, and rows with its
// normal would report false motion along the wall.
TEST(PatchGrouping, NoPlaneLeansAcrossAStep) {
  const DepthNoise noise;
  SurfaceTracker tracker(camera(), noise, kWindow);
  std::mt19937 random(6);
  std::normal_distribution<double> normal(0, 1);
  for (int edge = 120; edge <= 520; edge += 20) {
    cv::Mat_<float> depth(480, 640);
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        const double z = u < edge ? 0.9 : 1.02;
        depth(v, u) = static_cast<float>(z + noise.sigma(z) * normal(random));
      }
    }
    const std::vector<SurfacePatch> patches = tracker.patches(depth), shared = shareNormals(patches);
    EXPECT_GT(shared.size(), patches.size() * 8 / 10) << edge;
    double most = 0;
    for (const SurfacePatch& patch : shared) most = std::max(most, std::acos(std::min(1.0, -patch.n_C.z())));
    EXPECT_LT(most, 1.5 * kDegree) << edge;
  }
}

TEST(SurfaceTracker, HolesAndRoughSurfacesGiveNoPatches) {
  SurfaceTracker tracker(camera(), DepthNoise(), kWindow);
  EXPECT_TRUE(tracker.patches(cv::Mat(480, 640, CV_32FC1, cv::Scalar(0))).empty());
  cv::Mat_<float> rough(480, 640);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> z(2.0f, 3.0f);
  for (float& value : rough) value = z(random);
  EXPECT_TRUE(tracker.patches(rough).empty());
}

}  // namespace
}  // namespace vip_slam
