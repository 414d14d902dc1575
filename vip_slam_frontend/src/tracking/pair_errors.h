// SPDX-License-Identifier: BSD-3-Clause
// Errors of a point pair under a camera motion, pixels over the focal length. Internal to outlier rejection.
#pragma once

#include <cmath>

#include "vip_slam_frontend/tracking/outlier_rejection.h"

namespace vip_slam {

inline double reprojectionError(const PointPair& pair, const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  const Eigen::Vector3d p = pair.depth_previous * (R * pair.xy_previous.homogeneous()) + t;
  if (p.z() < 0.01) return 1e9;
  return (pair.pixels * (p.head<2>() / p.z() - pair.xy_current)).norm();
}

/// Distance of the current point from its epipolar line, t up to scale. Without translation: from the rotated point.
inline double epipolarError(const PointPair& pair, const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  const Eigen::Vector3d rotated = R * pair.xy_previous.homogeneous();
  const Eigen::Vector3d line = t.cross(rotated);
  const double norm = (pair.pixels.inverse().transpose() * line.head<2>()).norm();
  if (norm < 1e-6) return (pair.pixels * (rotated.head<2>() / rotated.z() - pair.xy_current)).norm();
  return std::abs(line.dot(pair.xy_current.homogeneous())) / norm;
}

/// By reprojection when `metric` and the pair has a depth, else by the epipolar line.
inline double pairError(const PointPair& pair, const Eigen::Matrix3d& R, const Eigen::Vector3d& t, bool metric) {
  return metric && pair.depth_previous > 0 ? reprojectionError(pair, R, t) : epipolarError(pair, R, t);
}

}  // namespace vip_slam
