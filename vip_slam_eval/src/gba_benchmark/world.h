// SPDX-License-Identifier: BSD-3-Clause
// Rectangles that carry points and occlude what is behind them, boxes of free clutter, and a path through them.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam::gba_benchmark {

struct Rectangle {
  int plane = 0;                 ///< index into World::planes
  Eigen::Vector3d corner, u, v;  ///< corner + a u + b v, a and b in [0, 1]
  bool textured = true;
};

struct Box {
  Eigen::Vector3d low, high;
};

struct WorldPlane {
  Plane plane;  ///< normal towards the inside
  PlaneKind kind = PlaneKind::kVertical;
};

struct World {
  std::vector<WorldPlane> planes;
  std::vector<Rectangle> rectangles;
  std::vector<Box> clutter;
  std::vector<Eigen::Vector4d> path;  ///< control points of a uniform cubic B-spline: x, y, z, yaw
  double speed = 1;                   ///< control points per second

  double duration() const { return (static_cast<double>(path.size()) - 3.0) / speed; }
  NavState stateAt(double t) const;
  ImuSample imuAt(double t) const;
  /// Nearest rectangle hit by origin + s direction, s > 0.05; -1 when none.
  int cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double* s) const;
};

/// `length` in keyframes scales the corridor. Throws std::invalid_argument for an unknown name.
World makeWorld(const std::string& name, int keyframes, double duration);

}  // namespace vip_slam::gba_benchmark
