// SPDX-License-Identifier: BSD-3-Clause
// Fitting planes to weighted points by total least squares.
//
// The paper solves [n_x/d, n_y/d] p = -1, which is singular for planes through the origin and biased near it. Here the
// normal is the eigenvector of the smallest eigenvalue of the scatter about the centroid, and d follows from it.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// sum w [p;1][p;1]^T
struct PlaneMoments {
  Eigen::Matrix4d M = Eigen::Matrix4d::Zero();

  void add(const Eigen::Vector3d& p, double w) {
    const Eigen::Vector4d h(p.x(), p.y(), p.z(), 1.0);
    M.noalias() += w * h * h.transpose();
  }
  double weight() const { return M(3, 3); }
  Eigen::Vector3d centroid() const { return M.topRightCorner<3, 1>() / weight(); }
  /// Weighted mean square distance to the plane.
  double meanSquare(const Plane& plane) const;
  /// Standard deviation of the points in the plane that they lie on, along the narrower direction, m; at least 1e-6.
  double spread() const;
  /// The moments of the points moved by T.
  PlaneMoments transformed(const SE3& T) const;
};

/// Least-squares plane of a kind: horizontal n = (0,0,+-1), vertical n_z = 0, general free. The normal's sign follows
/// `towards` (n . towards >= 0). False when the points do not determine it (no weight, or no extent).
bool fitPlane(const PlaneMoments& moments, PlaneKind kind, const Eigen::Vector3d& towards, Plane* plane);

/// The same with a free lean off the kind's normal, with a prior of `lean_sigma` radians; the weights are inverse
/// variances. While gravity is not known exactly, horizontal surfaces lean in the map; without it the plane's distance
/// from the origin would be wrong by the lean times the distance of its points.
bool fitLeaningPlane(const PlaneMoments& moments, PlaneKind kind, double lean_sigma, const Eigen::Vector3d& towards,
                     Plane* plane);

/// One sigma of the least certain direction of that plane's normal, radians, when the weights are inverse variances: a
/// single column of samples does not determine the direction of its wall. 0 for horizontal planes, infinite without
/// points.
double normalSigma(const PlaneMoments& moments, PlaneKind kind);

/// fitPlane() with Tukey's weights: points beyond about 4.7 times the scale (at least sigma) have no weight.
/// `weights` are the points' areas or inverse variances. `rms` (may be null) is that of the weighted inliers.
bool fitPlaneRobust(const std::vector<Eigen::Vector3d>& points, const std::vector<double>& weights, double sigma,
                    PlaneKind kind, const Eigen::Vector3d& towards, Plane* plane, double* rms);

}  // namespace vip_slam
