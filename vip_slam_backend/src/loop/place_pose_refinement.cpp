// Gauss-Newton on pixels and depths over the inliers.
#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "vip_slam_backend/loop/place_pose.h"

namespace vip_slam {
namespace {

// Normal equations of the matches in `use` at T_W_C; perturbation (theta, t), R <- R Exp(theta), t <- t + dt.
double linearise(const std::vector<PlaceMatch>& matches, const std::vector<std::uint32_t>& use, const SE3& T_W_C,
                 const PlacePoseOptions& options, Matrix6d* H, Vector6d* g) {
  H->setZero();
  g->setZero();
  const Eigen::Matrix3d R_C_W = T_W_C.R().transpose();
  const double huber = 1.5;
  double cost = 0;
  const auto add = [&](double r, const Eigen::Matrix<double, 1, 6>& J) {
    const double w = std::abs(r) <= huber ? 1.0 : huber / std::abs(r);
    *H += w * J.transpose() * J;
    *g += w * r * J.transpose();
    cost += std::abs(r) <= huber ? r * r : 2 * huber * std::abs(r) - huber * huber;
  };
  for (const std::uint32_t k : use) {
    const PlaceMatch& m = matches[k];
    const Eigen::Vector3d p = R_C_W * (m.p_W - T_W_C.t());
    if (p.z() < 0.05) continue;
    Eigen::Matrix<double, 3, 6> dp;
    dp.leftCols<3>() = hat(p);
    dp.rightCols<3>() = -R_C_W;
    const double weight = options.focal / m.scale, iz = 1.0 / p.z();
    add(weight * (p.x() * iz - m.xy.x()), weight * iz * (dp.row(0) - p.x() * iz * dp.row(2)));
    add(weight * (p.y() * iz - m.xy.y()), weight * iz * (dp.row(1) - p.y() * iz * dp.row(2)));
    if (m.depth > 0) {
      const double depth_weight = 1.0 / (m.depth_sigma + 0.005);
      add(depth_weight * (p.z() - m.depth), depth_weight * dp.row(2));
    }
  }
  return cost;
}

std::vector<std::uint32_t> inliersAt(const std::vector<PlaceMatch>& matches, const SE3& T_W_C, double px,
                                     const PlacePoseOptions& options) {
  std::vector<std::uint32_t> inliers;
  for (std::uint32_t k = 0; k < matches.size(); ++k)
    if (explains(T_W_C, matches[k], px, options)) inliers.push_back(k);
  return inliers;
}

}  // namespace

PlacePose refinePlacePose(const std::vector<PlaceMatch>& matches, const SE3& start, const PlacePoseOptions& options) {
  PlacePose result;
  result.T_W_C = start;
  // The gate closes in rounds: the start may be a few pixels off, the end is not.
  for (const double px : {2.5 * options.inlier_px, 1.5 * options.inlier_px, options.inlier_px}) {
    result.inliers = inliersAt(matches, result.T_W_C, px, options);
    if (result.inliers.size() < 3) return result;
    Matrix6d H;
    Vector6d g;
    double lambda = 1e-6, cost = linearise(matches, result.inliers, result.T_W_C, options, &H, &g);
    for (int iteration = 0; iteration < 15; ++iteration) {
      Matrix6d damped = H;
      damped.diagonal() += lambda * H.diagonal() + Vector6d::Constant(1e-9);
      const Vector6d delta = -damped.ldlt().solve(g);
      if (!delta.allFinite()) return result;
      const SE3 trial = result.T_W_C.boxplus(delta);
      Matrix6d trial_H;
      Vector6d trial_g;
      const double trial_cost = linearise(matches, result.inliers, trial, options, &trial_H, &trial_g);
      if (trial_cost <= cost) {
        result.T_W_C = trial;
        H = trial_H;
        g = trial_g;
        lambda = std::max(1e-9, 0.1 * lambda);
        const bool converged = delta.norm() < 1e-7 || cost - trial_cost < 1e-9 * cost;
        cost = trial_cost;
        if (converged) break;
      } else {
        lambda *= 10;
        if (lambda > 1e6) break;
      }
    }
    result.information = H;
  }
  result.inliers = inliersAt(matches, result.T_W_C, options.inlier_px, options);
  Vector6d g;
  linearise(matches, result.inliers, result.T_W_C, options, &result.information, &g);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(result.information);
  result.found = result.inliers.size() >= 3 && eigen.eigenvalues()(0) > 1.0;
  return result;
}

}  // namespace vip_slam
