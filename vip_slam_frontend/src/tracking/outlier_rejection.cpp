// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/outlier_rejection.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "pair_errors.h"
#include "vip_slam_frontend/tracking/general_motion.h"

namespace vip_slam {

namespace {

// The gyro's rotation is rejected when it explains less than a third of at least this many pairs ...
constexpr int kMinForOutliers = 15;
// ... and a motion with a free rotation explains two thirds of them. Less could belong to a moving body.

Eigen::Vector3d bearing(const Eigen::Vector2d& xy) { return {xy.x(), xy.y(), 1.0}; }

/// Reprojection residual of a pair with depth under R, t (pixels over the focal length), and its Jacobian by the
/// transformed point.
bool reprojectionOf(const PointPair& pair, const Eigen::Matrix3d& R, const Eigen::Vector3d& t, Eigen::Vector2d* r,
                    Eigen::Matrix<double, 2, 3>* J_p) {
  const Eigen::Vector3d p = R * (bearing(pair.xy_previous) * pair.depth_previous) + t;
  if (p.z() < 0.01) return false;
  const double iz = 1.0 / p.z();
  *r = pair.pixels * (pair.xy_current - p.head<2>() * iz);
  *J_p << iz, 0, -p.x() * iz * iz, 0, iz, -p.y() * iz * iz;
  *J_p = pair.pixels * *J_p;
  return true;
}

double huberWeight(double e, double huber) { return e > huber ? huber / e : 1.0; }

/// Normal equations of m x (R p + t) = 0 in t over the given pairs.
bool solveTranslation(const std::vector<PointPair>& pairs, const int* sample, int n, const Eigen::Matrix3d& R,
                      Eigen::Vector3d* t) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (int i = 0; i < n; ++i) {
    const PointPair& pair = pairs[sample[i]];
    const Eigen::Vector3d p = R * (bearing(pair.xy_previous) * pair.depth_previous);
    const Eigen::Matrix<double, 2, 3> J =
        (Eigen::Matrix<double, 2, 3>() << 1, 0, -pair.xy_current.x(), 0, 1, -pair.xy_current.y()).finished() /
        std::max(0.1, p.z());
    A += J.transpose() * J;
    b -= J.transpose() * (J * p);
  }
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(A);
  if (ldlt.vectorD().minCoeff() < 1e-9) return false;
  *t = ldlt.solve(b);
  return t->allFinite();
}

}  // namespace

bool refinePose(const std::vector<PointPair>& pairs, const std::vector<char>& use, double huber,
                SE3* T_current_previous) {
  SE3 T = *T_current_previous;
  for (int iteration = 0; iteration < 6; ++iteration) {
    Matrix6d A = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    int n = 0;
    const Eigen::Matrix3d R = T.R();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (!use[i] || pairs[i].depth_previous <= 0) continue;
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 3> J_p;
      if (!reprojectionOf(pairs[i], R, T.t(), &r, &J_p)) continue;
      const Eigen::Vector3d q = bearing(pairs[i].xy_previous) * pairs[i].depth_previous;
      Eigen::Matrix<double, 2, 6> J;
      J.leftCols<3>() = -J_p * R * hat(q);
      J.rightCols<3>() = J_p;
      const double w = huberWeight(r.norm(), huber);
      A += w * J.transpose() * J;
      b += w * J.transpose() * r;
      ++n;
    }
    if (n < 4) return false;
    const Eigen::LDLT<Matrix6d> ldlt(A);
    if (ldlt.vectorD().minCoeff() < 1e-9) return false;
    const Vector6d step = ldlt.solve(b);
    if (!step.allFinite()) return false;
    T = T.boxplus(step);
    if (step.norm() < 1e-8) break;
  }
  *T_current_previous = T;
  return true;
}

MotionFit fitMotion(const std::vector<PointPair>& pairs, const std::vector<char>& use, const SE3& start, double huber) {
  constexpr int kMinPairs = 8;
  MotionFit fit;
  fit.T_current_previous = start;
  if (!refinePose(pairs, use, huber, &fit.T_current_previous)) return fit;
  Matrix6d A = Matrix6d::Zero();
  double squares = 0;
  const Eigen::Matrix3d R = fit.T_current_previous.R();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!use[i] || pairs[i].depth_previous <= 0) continue;
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 3> J_p;
    if (!reprojectionOf(pairs[i], R, fit.T_current_previous.t(), &r, &J_p)) continue;
    Eigen::Matrix<double, 2, 6> J;
    J.leftCols<3>() = -J_p * R * hat(Eigen::Vector3d(bearing(pairs[i].xy_previous) * pairs[i].depth_previous));
    J.rightCols<3>() = J_p;
    const double w = huberWeight(r.norm(), huber);
    A += w * J.transpose() * J;
    squares += w * r.squaredNorm();
    ++fit.pairs;
  }
  if (fit.pairs < kMinPairs) return fit;
  fit.covariance = squares / (2.0 * fit.pairs - 6.0) * A.inverse();
  fit.ok = fit.T_current_previous.isFinite() && fit.covariance.allFinite();
  return fit;
}

RansacResult rejectOutliers(const std::vector<PointPair>& pairs, const SE3& predicted, const RansacOptions& options) {
  RansacResult result;
  result.inlier.assign(pairs.size(), 1);
  result.inliers = static_cast<int>(pairs.size());
  result.T_current_previous = predicted;
  if (pairs.size() < 5) return result;

  std::vector<int> with_depth, all;
  for (int i = 0; i < static_cast<int>(pairs.size()); ++i) {
    all.push_back(i);
    if (pairs[i].depth_previous > 0) with_depth.push_back(i);
  }
  result.with_depth = with_depth.size() >= 8;
  const std::vector<int>& pool = result.with_depth ? with_depth : all;
  const Eigen::Matrix3d R = predicted.R();
  std::mt19937 random(options.seed);
  std::uniform_int_distribution<int> pick(0, static_cast<int>(pool.size()) - 1);

  // Truncated squared error, so that of two models with equal inliers the tighter one wins.
  const double limit2 = options.threshold * options.threshold;
  const auto cost = [&](const Eigen::Vector3d& t, double best) {
    double sum = 0;
    for (const PointPair& pair : pairs) {
      const double e = pairError(pair, R, t, result.with_depth);
      sum += std::min(limit2, e * e);
      if (sum >= best) break;
    }
    return sum;
  };
  const auto allowed = [&](const Eigen::Vector3d& t) {
    return !(options.most_apart > 0) || (t - predicted.t()).norm() < options.most_apart;
  };
  Eigen::Vector3d best_t = predicted.t();
  double best = cost(best_t, 1e300);
  for (int k = 0; k < options.iterations; ++k) {
    const int sample[2] = {pool[pick(random)], pool[pick(random)]};
    if (sample[0] == sample[1]) continue;
    Eigen::Vector3d t;
    if (result.with_depth) {
      if (!solveTranslation(pairs, sample, 2, R, &t) || !allowed(t)) continue;
    } else {
      const PointPair &a = pairs[sample[0]], &b = pairs[sample[1]];
      const Eigen::Vector3d n0 = (R * bearing(a.xy_previous)).cross(bearing(a.xy_current));
      const Eigen::Vector3d n1 = (R * bearing(b.xy_previous)).cross(bearing(b.xy_current));
      t = n0.cross(n1);
      if (t.norm() < 1e-12) continue;
      t.normalize();
    }
    const double c = cost(t, best);
    if (c < best) {
      best = c;
      best_t = t;
    }
  }

  result.t_given_rotation = best_t;
  SE3 T(predicted.rotation(), best_t);
  const auto classify = [&]() {
    const Eigen::Matrix3d Rt = T.R();
    result.inliers = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      result.inlier[i] = pairError(pairs[i], Rt, T.t(), result.with_depth) < options.threshold;
      result.inliers += result.inlier[i];
    }
  };
  classify();
  // In front of a wall a small rotation looks like a sideways step: with a bounded translation keep the gyro's
  // rotation.
  const bool bounded = options.most_apart > 0;
  if (!bounded && result.with_depth && result.inliers >= 8 &&
      refinePose(pairs, result.inlier, 0.5 * options.threshold, &T)) {
    classify();
  }
  result.T_current_previous = T;
  result.ok = result.inliers >= 5;
  const int n = static_cast<int>(pairs.size());
  const bool mostly_outliers = n >= kMinForOutliers && 3 * result.inliers < n && !bounded;
  if (!mostly_outliers && !options.turn_unknown) return result;
  GeneralMotion general = poseFromDepth(pairs, predicted, options);
  if (!general.ok) return result;
  if (mostly_outliers ? 3 * general.inliers > 2 * n : general.inliers > result.inliers) {
    result.ok = true;
    result.free_rotation = true;
    result.with_depth = true;
    result.T_current_previous = general.T_current_previous;
    result.inlier = std::move(general.inlier);
    result.inliers = general.inliers;
  }
  return result;
}

}  // namespace vip_slam
