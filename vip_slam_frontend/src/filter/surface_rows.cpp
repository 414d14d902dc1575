// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/surface_rows.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/filter/qr.h"
#include "vip_slam_frontend/filter/shared_depth.h"
#include "vip_slam_frontend/filter/triangular_solve.h"
#include "vip_slam_frontend/filter/triangulation.h"

namespace vip_slam {

namespace {

/// Columns of the rows before compression: newest clone (theta, p), calibration of the camera, reference's clone
/// (theta, p).
struct Layout {
  explicit Layout(const WindowState& window) : calibration(window.calibration.camera()) {}
  const int calibration;
  int reference() const { return 6 + calibration; }
  int size() const { return 12 + calibration; }
  int rank() const { return 6 + calibration; }  ///< the relative pose, and the calibration
};

/// Covariance of the layout's columns.
Eigen::MatrixXd covarianceOf(const WindowState& window, const Layout& layout, int a, int b, const Eigen::MatrixXd& R) {
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(layout.size(), window.dimension());
  Y.block<6, 6>(0, window.cloneColumn(b)).setIdentity();
  Y.block(6, window.calibrationColumn(), layout.calibration, layout.calibration).setIdentity();
  Y.block<6, 6>(layout.reference(), window.cloneColumn(a)).setIdentity();
  solveRight(R, Y);
  return Y * Y.transpose();
}

/// Whitened rows; the last column is the residual. Residuals at the estimate, Jacobians at the first estimates.
Eigen::MatrixXd stackPairs(const WindowState& window, const Layout& layout, int a, int b,
                           const std::vector<SurfacePair>& pairs) {
  const Clone &from = window.clones[a], &to = window.clones[b];
  const SE3 T_ref_cur = cameraPose(window, from).inverse() * cameraPose(window, to);
  const Eigen::Matrix3d R_a = from.T_W_I_fej.R(), R_ab = R_a.transpose() * to.T_W_I_fej.R();
  const Eigen::Vector3d t_ab = R_a.transpose() * (to.T_W_I_fej.t() - from.T_W_I_fej.t());
  const Eigen::Matrix3d R_I_C = window.T_I_C.R();
  const Eigen::Vector3d t_I_C = window.T_I_C.t();
  const int reference = layout.reference();
  // Columns of the window's calibration, behind the newest clone's six.
  const int first = 6 - window.calibrationColumn();
  const int rotation = first + window.rotationColumn(), translation = first + window.translationColumn();
  const int offset = first + window.timeOffsetColumn(), shift = first + window.depthShiftColumn();
  const int depth = first + window.depthOffsetColumn(), scale = first + window.depthScaleColumn();
  const int delay = first + window.depthDelayColumn(), intrinsics = first + window.intrinsicsColumn();
  // For points from depth alone a shift of the depth image is equivalent to one of the principal point.
  Eigen::Matrix3d bearing = window.bearing.matrix();
  bearing.col(2).head<2>() -= window.depth_shift;
  const Eigen::Matrix3d given = bearing.inverse(), normal = given.transpose();

  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(static_cast<int>(pairs.size()), layout.size() + 1);
  for (int i = 0; i < A.rows(); ++i) {
    const SurfacePair& pair = pairs[i];
    const double w = 1.0 / pair.sigma;
    // The depth offset moves the points along their rays.
    const Eigen::Vector3d q_given = window.trueDepth(pair.q_cur.z()) / pair.q_cur.z() * pair.q_cur;
    const Eigen::Vector3d p_given = window.trueDepth(pair.p_ref.z()) / pair.p_ref.z() * pair.p_ref;
    const Eigen::Vector3d q_cur = bearing * q_given, p_ref = bearing * p_given;
    const Eigen::Vector3d q_ray = q_cur / q_cur.z(), p_ray = p_ref / p_ref.z();
    const Eigen::Vector3d n_ref = (normal * pair.n_ref).normalized();
    const Eigen::Vector3d q_I = R_I_C * q_cur + t_I_C;  // in the newest IMU frame
    const Eigen::Vector3d s_I = R_ab * q_I + t_ab;      // in the reference's
    const Eigen::RowVector3d n_I = w * (R_I_C * n_ref).transpose();
    const Eigen::RowVector3d n_W = n_I * R_a.transpose();
    A.block<1, 3>(i, 0) = -n_I * R_ab * hat(q_I);
    A.block<1, 3>(i, 3) = n_W;
    A.block<1, 3>(i, reference) = n_I * hat(s_I);
    A.block<1, 3>(i, reference + 3) = -n_W;
    if (window.calibration.rotation) {
      // s_C = R_I_C^T (R_ab (R_I_C q + t) + t_ab - t)
      const Eigen::Vector3d s_C = R_I_C.transpose() * (s_I - t_I_C);
      const Eigen::Matrix3d R_ref_cur = R_I_C.transpose() * R_ab * R_I_C;
      A.block<1, 3>(i, rotation) = w * n_ref.transpose() * (hat(s_C) - R_ref_cur * hat(q_cur));
    }
    if (window.calibration.translation) {
      A.block<1, 3>(i, translation) = n_I * (R_ab - Eigen::Matrix3d::Identity());
    }
    const double later = A.block<1, 3>(i, 0).dot(to.omega_I) + A.block<1, 3>(i, 3).dot(to.v_W) +
                         A.block<1, 3>(i, reference).dot(from.omega_I) + A.block<1, 3>(i, reference + 3).dot(from.v_W);
    if (window.calibration.time_offset) A(i, offset) = later;
    if (window.calibration.depth_delay) A(i, delay) = -later;
    if (window.calibration.depth_offset) A(i, depth) = w * n_ref.dot(R_I_C.transpose() * R_ab * R_I_C * q_ray - p_ray);
    if (window.calibration.depth_scale) A(i, scale) = -w * n_ref.dot(R_I_C.transpose() * (R_ab * t_I_C + t_ab - t_I_C));
    if (window.calibration.intrinsics || window.calibration.depth_shift) {
      // d(x, y) of a point (x, y, z) by (sx, sy, cx, cy): (x, 0), (0, y), (z, 0), (0, z). The normal rotates the other
      // way, which acts on the distance of the two points along the plane.
      const Eigen::Matrix3d R_ref_cur = R_I_C.transpose() * R_ab * R_I_C;
      const Eigen::RowVector3d n_cur = n_ref.transpose() * R_ref_cur;
      const Eigen::Vector3d apart = R_I_C.transpose() * (s_I - t_I_C) - p_ref;
      const Eigen::Vector3d beside = apart - n_ref.dot(apart) * n_ref, beside_given = given * beside;
      for (int k = 0; k < 2; ++k) {
        const double by_scale = n_cur(k) * q_given(k) - n_ref(k) * p_given(k) - n_ref(k) * beside_given(k);
        const double by_centre = n_cur(k) * q_cur.z() - n_ref(k) * p_ref.z() - n_ref(k) * beside.z();
        if (window.calibration.intrinsics) A(i, intrinsics + k) = w * by_scale;
        if (window.calibration.intrinsics) A(i, intrinsics + 2 + k) = w * by_centre;
        if (window.calibration.depth_shift) A(i, shift + k) = -w * by_centre;
      }
    }
    A(i, layout.size()) = -w * n_ref.dot(T_ref_cur * q_cur - p_ref) + later * window.depth_delay;
  }
  return A;
}

/// Multiplies the rows of one surface (numbers in `rows`) by the inverse root of their covariance I + S. S is what they
/// share: the nearer two patches were in the reference's image, the more.
void whitenShared(const std::vector<SurfacePair>& pairs, const std::vector<int>& rows, Eigen::MatrixXd* A) {
  const int n = static_cast<int>(rows.size());
  Eigen::ArrayXd x(n), y(n), shared(n);
  Eigen::MatrixXd of_surface(n, A->cols());
  for (int k = 0; k < n; ++k) {
    const SurfacePair& pair = pairs[rows[k]];
    x(k) = pair.p_ref.x() / pair.p_ref.z(), y(k) = pair.p_ref.y() / pair.p_ref.z();
    shared(k) = pair.shared / pair.sigma;
    of_surface.row(k) = A->row(rows[k]);
  }
  Eigen::MatrixXd covariance(n, n);  // lower triangle
  for (int k = 0; k < n; ++k) {
    const int below = n - k;
    const Eigen::ArrayXd apart = ((x.tail(below) - x(k)).square() + (y.tail(below) - y(k)).square()).sqrt();
    covariance.col(k).tail(below) = shared(k) * shared.tail(below) * (apart / -kDepthCorrelationLength).exp();
  }
  covariance.diagonal().array() += 1;
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(covariance);  // in place
  factor.matrixL().solveInPlace(of_surface);
  for (int k = 0; k < n; ++k) A->row(rows[k]) = of_surface.row(k);
}

}  // namespace

SurfaceRows surfaceRows(const WindowState& window, const Eigen::MatrixXd& R, const SurfaceMatches& matches,
                        double huber) {
  SurfaceRows result;
  const int a = window.indexOf(matches.reference), b = static_cast<int>(window.clones.size()) - 1;
  if (a < 0 || a == b || static_cast<int>(matches.pairs.size()) < kEnough) return result;
  const Layout layout(window);
  Eigen::MatrixXd A = stackPairs(window, layout, a, b, matches.pairs);

  // Variance of each whitened residual: the state's uncertainty plus its noise.
  const Eigen::MatrixXd P = covarianceOf(window, layout, a, b, R);
  std::map<int, std::vector<int>> surfaces;  // rows by surface
  for (int i = 0; i < A.rows(); ++i) {
    const auto h = A.row(i).head(layout.size());
    const SurfacePair& pair = matches.pairs[i];
    const double variance = h * P * h.transpose() + 1.0 + std::pow(pair.shared / pair.sigma, 2);
    const double relative = std::abs(A(i, layout.size())) / std::sqrt(variance);
    if (!(relative < kGateSigmas)) {
      ++result.gated;
      continue;
    }
    if (relative > huber) A.row(i) *= std::sqrt(huber / relative);
    surfaces[pair.surface].push_back(i);
    ++result.used;
  }
  if (result.used < kEnough || result.used < result.gated) {
    result.used = 0;
    return result;
  }
  for (const auto& [surface, rows] : surfaces) whitenShared(matches.pairs, rows, &A);
  int kept = 0;
  Eigen::MatrixXd used(result.used, A.cols());
  for (const auto& [surface, rows] : surfaces) {
    for (int row : rows) used.row(kept++) = A.row(row);
  }
  A.swap(used);
  triangularise(A, layout.rank());
  const int rank = std::min(layout.rank(), result.used);
  result.rows.H = Eigen::MatrixXd::Zero(rank, window.dimension());
  result.rows.H.middleCols<6>(window.cloneColumn(b)) = A.topLeftCorner(rank, 6);
  result.rows.H.middleCols(window.calibrationColumn(), layout.calibration) = A.block(0, 6, rank, layout.calibration);
  result.rows.H.middleCols<6>(window.cloneColumn(a)) = A.block(0, layout.reference(), rank, 6);
  result.rows.r = A.col(layout.size()).head(rank);
  return result;
}

}  // namespace vip_slam
