// SPDX-License-Identifier: BSD-3-Clause
// Gauss-Newton on pixels and depths over the inliers, and on the distances of surfaces to their planes.
#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "vip_slam_backend/loop/place_pose.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {
namespace {

constexpr double kHuber = 1.5;

double huberWeight(double absolute) { return absolute <= kHuber ? 1.0 : kHuber / absolute; }

double depthWeight(const PlaceMatch& match) { return 1.0 / (match.depth_sigma + 0.005); }

class Refinement {
 public:
  Refinement(const std::vector<PlaceMatch>& matches, const CameraRig& rig, const Eigen::Quaterniond& R_G_B,
             const PlacePoseOptions& options, const std::vector<PlaceSurface>& surfaces)
      : matches_(matches),
        surfaces_(surfaces),
        rig_(rig),
        up_B_(R_G_B.conjugate() * Eigen::Vector3d::UnitZ()),
        options_(options) {
    for (const SE3& T_B_C : rig) R_C_B_.push_back(T_B_C.R().transpose());
  }

  std::vector<std::uint32_t> inliersAt(const SE3& T_W_B, double px) const {
    std::vector<SE3> T_W_C;
    for (const SE3& T_B_C : rig_) T_W_C.push_back(T_W_B * T_B_C);
    std::vector<std::uint32_t> inliers;
    for (std::uint32_t k = 0; k < matches_.size(); ++k)
      if (explains(T_W_C[matches_[k].camera], matches_[k], px, options_)) inliers.push_back(k);
    return inliers;
  }

  // Normal equations of the matches in `use` at T_W_B; perturbation (theta, t), R <- R Exp(theta), t <- t + dt.
  // Returns the cost.
  double linearise(const std::vector<std::uint32_t>& use, const SE3& T_W_B, Matrix6d* H, Vector6d* g) const {
    H->setZero();
    g->setZero();
    const Eigen::Matrix3d R_B_W = T_W_B.R().transpose();
    const double huber = kHuber;
    double cost = 0;
    const auto add = [&](double r, const Eigen::Matrix<double, 1, 6>& J) {
      const double w = huberWeight(std::abs(r));
      *H += w * J.transpose() * J;
      *g += w * r * J.transpose();
      cost += std::abs(r) <= huber ? r * r : 2 * huber * std::abs(r) - huber * huber;
    };
    for (const std::uint32_t k : use) {
      const PlaceMatch& m = matches_[k];
      const Eigen::Matrix3d& R_C_B = R_C_B_[m.camera];
      const Eigen::Vector3d p_B = R_B_W * (m.p_W - T_W_B.t());
      const Eigen::Vector3d p = R_C_B * (p_B - rig_[m.camera].t());
      if (p.z() < 0.05) continue;
      Eigen::Matrix<double, 3, 6> dp;
      dp.leftCols<3>() = R_C_B * hat(p_B);
      dp.rightCols<3>() = -R_C_B * R_B_W;
      const double weight = options_.focal / m.scale, iz = 1.0 / p.z();
      add(weight * (p.x() * iz - m.xy.x()), weight * iz * (dp.row(0) - p.x() * iz * dp.row(2)));
      add(weight * (p.y() * iz - m.xy.y()), weight * iz * (dp.row(1) - p.y() * iz * dp.row(2)));
      if (m.depth > 0) {
        const double depth_weight = depthWeight(m);
        add(depth_weight * (p.z() - m.depth), depth_weight * dp.row(2));
      }
    }
    for (const PlaceSurface& s : surfaces_) {
      const Eigen::Vector3d p_B = rig_[s.camera] * s.p_C;
      const Eigen::RowVector3d n_B = (R_B_W * s.plane_W.n).transpose();
      Eigen::Matrix<double, 1, 6> J;
      J << -n_B * hat(p_B), s.plane_W.n.transpose();
      add(s.plane_W.signedDistance(T_W_B * p_B) / s.sigma, J / s.sigma);
    }
    if (options_.tilt_sigma > 0) {
      // Direction of up in the body; three rows, of rank two.
      const Eigen::Vector3d up = R_B_W * Eigen::Vector3d::UnitZ();
      Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
      J.leftCols<3>() = hat(up);
      for (int i = 0; i < 3; ++i) add((up(i) - up_B_(i)) / options_.tilt_sigma, J.row(i) / options_.tilt_sigma);
    }
    return cost;
  }

  // Information at T_W_B of the estimate with the normal equations H, in which depths count as independent: with rows
  // J_k, weighted and whitened, and errors of covariance C that they share it has the covariance
  // H^-1 (H + sum J_k^T C_kl J_l) H^-1.
  Matrix6d information(const std::vector<std::uint32_t>& use, const SE3& T_W_B, const Matrix6d& H) const {
    std::vector<Vector6d> rows;
    std::vector<Eigen::Vector3d> bearings;
    const Eigen::Matrix3d R_B_W = T_W_B.R().transpose();
    for (const std::uint32_t k : use) {
      const PlaceMatch& m = matches_[k];
      if (!(m.depth > 0)) continue;
      const Eigen::Matrix3d& R_C_B = R_C_B_[m.camera];
      const Eigen::Vector3d p_B = R_B_W * (m.p_W - T_W_B.t());
      const Eigen::Vector3d p = R_C_B * (p_B - rig_[m.camera].t());
      if (p.z() < 0.05) continue;
      const double weight = depthWeight(m), whitened = std::abs(weight * (p.z() - m.depth));
      Vector6d row;
      row << (R_C_B * hat(p_B)).row(2).transpose(), -(R_C_B * R_B_W).row(2).transpose();
      rows.push_back(weight * weight * huberWeight(whitened) * options_.depth_shared * m.depth_sigma * row);
      bearings.push_back(p_B.normalized());
    }
    Matrix6d shared = Matrix6d::Zero();
    for (std::size_t k = 0; k < rows.size(); ++k)
      for (std::size_t l = 0; l < rows.size(); ++l)
        shared +=
            std::exp(-(bearings[k] - bearings[l]).norm() / kDepthCorrelationLength) * rows[k] * rows[l].transpose();
    return H * (H + shared).ldlt().solve(H);
  }

  // Levenberg-Marquardt over `use`. False when it breaks down.
  bool minimise(const std::vector<std::uint32_t>& use, SE3* T_W_B) const {
    Matrix6d H, trial_H;
    Vector6d g, trial_g;
    double lambda = 1e-6, cost = linearise(use, *T_W_B, &H, &g);
    for (int iteration = 0; iteration < 15 && lambda <= 1e6; ++iteration) {
      Matrix6d damped = H;
      damped.diagonal() += lambda * H.diagonal() + Vector6d::Constant(1e-9);
      const Vector6d delta = -damped.ldlt().solve(g);
      if (!delta.allFinite()) return false;
      const SE3 trial = T_W_B->boxplus(delta);
      const double trial_cost = linearise(use, trial, &trial_H, &trial_g);
      if (trial_cost > cost) {
        lambda *= 10;
        continue;
      }
      *T_W_B = trial;
      H = trial_H;
      g = trial_g;
      lambda = std::max(1e-9, 0.1 * lambda);
      const bool converged = delta.norm() < 1e-7 || cost - trial_cost < 1e-9 * cost;
      cost = trial_cost;
      if (converged) break;
    }
    return true;
  }

 private:
  const std::vector<PlaceMatch>& matches_;
  const std::vector<PlaceSurface>& surfaces_;
  const CameraRig& rig_;
  std::vector<Eigen::Matrix3d> R_C_B_;
  Eigen::Vector3d up_B_;
  const PlacePoseOptions& options_;
};

}  // namespace

PlacePose refinePlacePose(const std::vector<PlaceMatch>& matches, const CameraRig& rig, const SE3& start,
                          const Eigen::Quaterniond& R_G_B, const PlacePoseOptions& options,
                          const std::vector<PlaceSurface>& surfaces) {
  const Refinement refinement(matches, rig, R_G_B, options, surfaces);
  PlacePose result;
  result.T_W_B = start;
  // The gate is tightened in rounds, since the start may be wrong by a few pixels.
  for (const double px : {2.5 * options.inlier_px, 1.5 * options.inlier_px, options.inlier_px}) {
    result.inliers = refinement.inliersAt(result.T_W_B, px);
    if (result.inliers.size() < 3 || !refinement.minimise(result.inliers, &result.T_W_B)) return result;
  }
  result.inliers = refinement.inliersAt(result.T_W_B, options.inlier_px);
  Vector6d g;
  refinement.linearise(result.inliers, result.T_W_B, &result.information, &g);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(result.information);
  result.found = result.inliers.size() >= 3 && eigen.eigenvalues()(0) > 1.0;
  if (result.found) result.information = refinement.information(result.inliers, result.T_W_B, result.information);
  return result;
}

}  // namespace vip_slam
