// SPDX-License-Identifier: BSD-3-Clause
// Homography of a plane between two keyframes (paper section "Compressed Homography Measurement", equations 3 to 7,
// corrected):
//   H = R_j^T (I - a n^T / D) R_i,  a = t_i - t_j,  D = d + n^T t_i   (camera poses),  H p_i = (z_j / z_i) p_j.
// One pair of observations gives C_l vec(H) = rho (p^_j - p_j) (rows of 9, row-major vec), weighted by
// f / (sigma_px rho) with rho frozen, so that the cost is the reprojection cost. N pairs on one plane compress into
// G_h = sum C^T C: cost C^ch = 1/2 h^T G_h h, residual r^ch = L^T h with G_h = L L^T.
#pragma once

#include <array>

#include <Eigen/Core>

#include "vip_slam_backend/factors/reprojection.h"
#include "vip_slam_core/geometry/plane.h"

namespace vip_slam {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
/// Columns: theta_i, t_i, theta_j, t_j (IMU poses), plane (two in the tangent plane of n, one for d).
using HomographyJacobian = Eigen::Matrix<double, 9, 15>;

struct HomographyPair {
  Eigen::Vector2d xy_i = Eigen::Vector2d::Zero(), xy_j = Eigen::Vector2d::Zero();  ///< undistorted, z = 1
  double weight = 1;                                                               ///< f / (sigma_px |rho|)
};

/// vec(H), row-major. `basis`: tangentBasis(plane.n), needed with J only.
Vector9d homographyVector(const FrameGeometry& i, const FrameGeometry& j, const Plane& plane,
                          const Eigen::Matrix<double, 3, 2>* basis = nullptr, HomographyJacobian* J = nullptr);

/// The geometry is too weak within 10 degrees of the degenerate one (sine): a host's ray along the plane.
constexpr double kMinIncidence = 0.1736;

/// Whether a camera with normal `n_C` of a plane in its axes, at signed `distance` from it, may be the host of its
/// point at xy (above): the ray not along the plane, the point before the camera.
inline bool mayHost(const Eigen::Vector3d& n_C, double distance, const Eigen::Vector2d& xy) {
  const double incidence = n_C.dot(xy.homogeneous());
  return incidence * incidence >= kMinIncidence * kMinIncidence * (xy.squaredNorm() + 1.0) &&
         -distance / incidence >= kMinProjectionDepth;
}

/// H p_i for p_i = (xy_i, 1); the third entry is the depth ratio.
inline Eigen::Vector3d transfer(const Vector9d& h, const Eigen::Vector2d& xy_i) {
  const double x = xy_i.x(), y = xy_i.y();
  return {h(0) * x + h(1) * y + h(2), h(3) * x + h(4) * y + h(5), h(6) * x + h(7) * y + h(8)};
}

/// Mean factor on the variance of xy_i when it is transferred into frame j: half the squared Frobenius norm of
/// d p^_j / d p_i. A pair's variance is that of j plus this gain times that of i. `p` = H p_i.
double hostNoiseGain(const Vector9d& h, const Eigen::Vector3d& p);

/// The two rows C_l, weighted.
Eigen::Matrix<double, 2, 9> homographyRows(const HomographyPair& pair);

/// G_h of any number of pairs in 24 numbers. With p = (x_i, y_i, 1), (u, v) = xy_j and the pair's weight w
///   G = [A 0 -B; 0 A -C; -B -C D],  A = sum w^2 p p^T,  B = sum w^2 u p p^T,  C = sum w^2 v p p^T,
///   D = sum w^2 (u^2 + v^2) p p^T,  each kept as xx xy xz yy yz zz.
using HomographySums = std::array<double, 24>;

/// Adds C_l^T C_l.
void addHomographyPair(const HomographyPair& pair, HomographySums* sums);
Matrix9d homographyMatrix(const HomographySums& sums);
bool isFinite(const HomographySums& sums);

/// Rows L^T (at most 9) with G = L L^T; eigenvalues below 1e-12 of the largest are dropped. Returns the number of rows.
int decomposeHomography(const Matrix9d& G, Matrix9d* rows);

}  // namespace vip_slam
