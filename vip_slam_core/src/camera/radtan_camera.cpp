// SPDX-License-Identifier: BSD-3-Clause
#include "camera/radtan_camera.h"

#include <cmath>

#include <Eigen/LU>

namespace vip_slam {

Eigen::Vector2d PinholeCamera::distort(const Eigen::Vector2d& xy, Eigen::Matrix2d* J) const {
  if (J) *J << intrinsics_.fx, 0, 0, intrinsics_.fy;
  return {intrinsics_.fx * xy.x() + intrinsics_.cx, intrinsics_.fy * xy.y() + intrinsics_.cy};
}

bool PinholeCamera::undistort(const Eigen::Vector2d& uv, Eigen::Vector2d* xy) const {
  *xy << (uv.x() - intrinsics_.cx) / intrinsics_.fx, (uv.y() - intrinsics_.cy) / intrinsics_.fy;
  return true;
}

RadTanCamera::RadTanCamera(const CameraIntrinsics& intrinsics) : CameraModel(intrinsics) {
  const std::vector<double>& d = intrinsics_.distortion;
  if (d.size() >= 4) k1_ = d[0], k2_ = d[1], p1_ = d[2], p2_ = d[3];
  if (d.size() >= 5) k3_ = d[4];
  if (d.size() >= 8) k4_ = d[5], k5_ = d[6], k6_ = d[7];
  // The radial part folds over where d(r g(r^2))/dr reaches zero. Search outwards, well past any usable field of view.
  constexpr double kStep = 0.005, kLimit = 6.0;
  max_radius2_ = kLimit * kLimit;
  double previous = 0;
  for (double r = kStep; r <= kLimit; r += kStep) {
    const double r2 = r * r;
    const double denominator = 1 + r2 * (k4_ + r2 * (k5_ + r2 * k6_));
    const double distorted = r * (1 + r2 * (k1_ + r2 * (k2_ + r2 * k3_))) / denominator;
    if (denominator <= 0 || distorted <= previous) {
      max_radius2_ = (r - kStep) * (r - kStep);
      break;
    }
    previous = distorted;
  }
}

Eigen::Vector2d RadTanCamera::distortNormalised(const Eigen::Vector2d& xy, Eigen::Matrix2d* J) const {
  const double x = xy.x(), y = xy.y();
  const double r2 = x * x + y * y;
  const double numerator = 1 + r2 * (k1_ + r2 * (k2_ + r2 * k3_));
  const double denominator = 1 + r2 * (k4_ + r2 * (k5_ + r2 * k6_));
  const double g = numerator / denominator;
  if (J) {
    // dg/d(r^2); d(r^2)/dx = 2x
    const double dn = k1_ + r2 * (2 * k2_ + 3 * r2 * k3_);
    const double dd = k4_ + r2 * (2 * k5_ + 3 * r2 * k6_);
    const double dg = (dn - g * dd) / denominator;
    const double cross = 2 * x * y * dg + 2 * p1_ * x + 2 * p2_ * y;
    *J << g + 2 * x * x * dg + 2 * p1_ * y + 6 * p2_ * x, cross,  //
        cross, g + 2 * y * y * dg + 6 * p1_ * y + 2 * p2_ * x;
  }
  return {x * g + 2 * p1_ * x * y + p2_ * (r2 + 2 * x * x), y * g + p1_ * (r2 + 2 * y * y) + 2 * p2_ * x * y};
}

Eigen::Vector2d RadTanCamera::distort(const Eigen::Vector2d& xy, Eigen::Matrix2d* J) const {
  const Eigen::Vector2d d = distortNormalised(xy, J);
  if (J) {
    J->row(0) *= intrinsics_.fx;
    J->row(1) *= intrinsics_.fy;
  }
  return {intrinsics_.fx * d.x() + intrinsics_.cx, intrinsics_.fy * d.y() + intrinsics_.cy};
}

bool RadTanCamera::undistort(const Eigen::Vector2d& uv, Eigen::Vector2d* xy) const {
  const Eigen::Vector2d target((uv.x() - intrinsics_.cx) / intrinsics_.fx, (uv.y() - intrinsics_.cy) / intrinsics_.fy);
  constexpr double kTolerance = 1e-12;
  const double max_radius = std::sqrt(max_radius2_);
  Eigen::Vector2d estimate = target;
  if (estimate.norm() > max_radius) estimate *= max_radius / estimate.norm();
  Eigen::Matrix2d J;
  Eigen::Vector2d error = target - distortNormalised(estimate, &J);
  for (int iteration = 0; iteration < 20 && error.squaredNorm() > kTolerance * kTolerance; ++iteration) {
    const double determinant = J.determinant();
    if (!(std::abs(determinant) > 1e-12)) break;
    Eigen::Vector2d step = J.inverse() * error;
    // Near the fold the full step may overshoot into the mirrored branch: halve until the error shrinks.
    bool improved = false;
    for (int halving = 0; halving < 8 && !improved; ++halving, step *= 0.5) {
      const Eigen::Vector2d candidate = estimate + step;
      if (candidate.squaredNorm() > max_radius2_) continue;
      Eigen::Matrix2d J_candidate;
      const Eigen::Vector2d candidate_error = target - distortNormalised(candidate, &J_candidate);
      if (candidate_error.squaredNorm() < error.squaredNorm()) {
        estimate = candidate;
        error = candidate_error;
        J = J_candidate;
        improved = true;
      }
    }
    if (!improved) break;
  }
  *xy = estimate;
  return error.squaredNorm() < 1e-16;
}

}  // namespace vip_slam
