// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/detection/surface_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "vip_slam_core/util/significance.h"

namespace vip_slam {
namespace {

constexpr double kMinSteepness = 0.5;  // sine of the angle between a normal and the vertical
constexpr double kCore = 0.12;  // share of the width that inner vertices must span; a single column zigzags by less

struct Extent {
  double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
  void add(double q) { low = std::min(low, q), high = std::max(high, q); }
  double length() const { return std::max(0.0, high - low); }
};

}  // namespace

bool isSolid(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface) {
  enum : char { kNone, kInside, kOnBorder };
  std::vector<char> member(triangles.size(), 0), place;
  for (int i : surface) {
    member[i] = 1;
    const std::array<int, 3>& v = triangles[i].vertex;
    place.resize(std::max<std::size_t>(place.size(), 1 + std::max({v[0], v[1], v[2]})), kNone);
    for (int k : v) place[k] = kInside;
  }
  for (int i : surface) {
    const MapTriangle& t = triangles[i];
    for (int k = 0; k < 3; ++k) {
      if (t.neighbour[k] >= 0 && member[t.neighbour[k]]) continue;
      place[t.vertex[(k + 1) % 3]] = place[t.vertex[(k + 2) % 3]] = kOnBorder;
    }
  }
  const auto inside = static_cast<std::size_t>(std::count(place.begin(), place.end(), kInside));
  if (inside < 4 || 10 * inside < surface.size()) return false;

  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (int i : surface) normal += triangles[i].area * triangles[i].n;
  const Eigen::Vector3d along = Eigen::Vector3d::UnitZ().cross(normal.normalized());
  if (along.norm() < kMinSteepness) return true;
  Extent all, core;
  for (int i : surface) {
    for (int k = 0; k < 3; ++k) {
      const double q = along.dot(triangles[i].corner[k]);
      all.add(q);
      if (place[triangles[i].vertex[k]] == kInside) core.add(q);
    }
  }
  return core.length() >= kCore * all.length();
}

bool isCurved(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface, const Plane& plane,
              double sigma) {
  constexpr double kBends = 1 / 4.0;   // 1/m, at three sigmas; lens and depth distortion bend walls by less
  constexpr double kColumn = 1 / 1.0;  // 1/m, curvature that must be excluded by one sigma
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  const Eigen::Matrix<double, 3, 2> basis = tangentBasis(plane.n);
  Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 g = Vector6::Zero();
  const Eigen::Vector3d origin = triangles[surface.front()].centre;
  for (int i : surface) {
    const Eigen::Vector2d q = basis.transpose() * (triangles[i].centre - origin);
    const Vector6 row = (Vector6() << 1, q.x(), q.y(), q.x() * q.x(), q.x() * q.y(), q.y() * q.y()).finished();
    const double w = 1.0 / (triangles[i].sigma * triangles[i].sigma + sigma * sigma);
    H.noalias() += w * row * row.transpose();
    g.noalias() += w * row * plane.signedDistance(triangles[i].centre);
  }
  const auto solver = (H + 1e-9 * H.trace() * Eigen::Matrix<double, 6, 6>::Identity()).ldlt();
  const Vector6 x = solver.solve(g);
  Eigen::Matrix2d bend;
  bend << 2 * x(3), x(4), x(4), 2 * x(5);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(bend);
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d a = axes.eigenvectors().col(k);
    const Vector6 j = (Vector6() << 0, 0, 0, 2 * a.x() * a.x(), 2 * a.x() * a.y(), 2 * a.y() * a.y()).finished();
    const double error = std::sqrt(std::max(0.0, j.dot(solver.solve(j))));
    const double bends = std::abs(axes.eigenvalues()(k));
    if (bends - kNoiseSigmas * error > kBends || bends + error > kColumn) return true;
  }
  return false;
}

bool mayBeAStep(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface, const Plane& plane,
                const Eigen::Vector3d& camera) {
  constexpr double kSteep = 0.6;              // cosine of the angle between normal and viewing ray
  constexpr double kHiddenStep = 5.0 * 2.45;  // sigmas; the mesh breaks at five of a second difference, sqrt(1 + 4 + 1)
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0, facing = 0, sigma = 0;
  for (int i : surface) {
    const Eigen::Vector3d ray = triangles[i].centre - camera;
    const double level = ray.head<2>().norm();
    nearest = std::min(nearest, level), farthest = std::max(farthest, level);
    facing -= plane.n.dot(ray) / ray.norm() / double(surface.size());
    sigma += triangles[i].sigma / double(surface.size());
  }
  // Sigmas are along the normal: those of depth are larger by 1 / facing.
  return facing < kSteep && (farthest - nearest) * std::max(0.0, facing) < kHiddenStep * sigma;
}

bool facetsLean(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface, const Plane& plane,
                const Eigen::Vector3d& axis, double tolerance) {
  std::vector<std::pair<double, double>> leans;  // angle, area
  double variance = 0, area = 0;
  for (int i : surface) {
    const MapTriangle& t = triangles[i];
    leans.emplace_back(std::atan2(axis.dot(t.n), plane.n.dot(t.n)), t.area);
    variance += t.sigma_angle * t.sigma_angle;
    area += t.area;
  }
  std::sort(leans.begin(), leans.end());
  double below = 0;
  const auto median = std::find_if(leans.begin(), leans.end(), [&](const auto& lean) {
    below += lean.second;
    return 2 * below >= area;
  });
  const double uncertainty = std::sqrt(variance) / double(surface.size());
  return median != leans.end() && std::abs(median->first) > tolerance + uncertainty;
}

}  // namespace vip_slam
