// SPDX-License-Identifier: BSD-3-Clause
#include "camera/equidistant_camera.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {
namespace {

// Normalised coordinates (z = 1) exist only for angles below 90 degrees; stay a little away from it.
constexpr double kLargestAngle = 1.55;

}  // namespace

EquidistantCamera::EquidistantCamera(const CameraIntrinsics& intrinsics)
    : CameraModel(intrinsics), max_angle_(kLargestAngle) {
  std::copy_n(intrinsics_.distortion.begin(), std::min<std::size_t>(4, intrinsics_.distortion.size()), k_);
  constexpr double kStep = 0.005;
  for (double theta = 0; theta < kLargestAngle; theta += kStep) {
    double derivative;
    distortAngle(theta, &derivative);
    if (derivative <= 0) {
      max_angle_ = theta - kStep;
      break;
    }
  }
  max_radius2_ = std::tan(max_angle_) * std::tan(max_angle_);
}

double EquidistantCamera::distortAngle(double theta, double* derivative) const {
  const double y = theta * theta;
  if (derivative) *derivative = 1 + y * (3 * k_[0] + y * (5 * k_[1] + y * (7 * k_[2] + y * 9 * k_[3])));
  return theta * (1 + y * (k_[0] + y * (k_[1] + y * (k_[2] + y * k_[3]))));
}

Eigen::Vector2d EquidistantCamera::distort(const Eigen::Vector2d& xy, Eigen::Matrix2d* J) const {
  const double r2 = xy.squaredNorm();
  const double r = std::sqrt(r2);
  double derivative;
  const double theta_d = distortAngle(std::atan(r), &derivative);
  const double scale = r > 1e-8 ? theta_d / r : 1.0;
  if (J) {
    // d(scale)/dr / r = (theta_d'(r) r - theta_d) / r^3, with theta_d'(r) = theta_d'(theta) / (1 + r^2)
    const double slope = r > 1e-4 ? (derivative / (1 + r2) - scale) / r2 : 2.0 * (k_[0] - 1.0 / 3.0);
    *J = scale * Eigen::Matrix2d::Identity() + slope * xy * xy.transpose();
    J->row(0) *= intrinsics_.fx;
    J->row(1) *= intrinsics_.fy;
  }
  return {intrinsics_.fx * scale * xy.x() + intrinsics_.cx, intrinsics_.fy * scale * xy.y() + intrinsics_.cy};
}

bool EquidistantCamera::undistort(const Eigen::Vector2d& uv, Eigen::Vector2d* xy) const {
  const Eigen::Vector2d d((uv.x() - intrinsics_.cx) / intrinsics_.fx, (uv.y() - intrinsics_.cy) / intrinsics_.fy);
  const double theta_d = d.norm();
  if (theta_d < 1e-12) {
    *xy = d;
    return true;
  }
  // Newton inside a bracket: theta_d(theta) grows on [0, max_angle_].
  double low = 0, high = max_angle_;
  double theta = std::min(theta_d, max_angle_);
  const bool reachable = theta_d <= distortAngle(max_angle_, nullptr);
  if (!reachable) theta = max_angle_;
  for (int iteration = 0; reachable && iteration < 50; ++iteration) {
    double derivative;
    const double error = theta_d - distortAngle(theta, &derivative);
    if (std::abs(error) < 1e-14) break;
    (error > 0 ? low : high) = theta;
    double next = theta + error / derivative;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == theta) break;
    theta = next;
  }
  *xy = d * (std::tan(theta) / theta_d);
  return reachable;
}

}  // namespace vip_slam
