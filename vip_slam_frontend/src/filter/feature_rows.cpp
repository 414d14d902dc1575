// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/feature_rows.h"

#include <algorithm>
#include <cmath>

#include "packs.h"
#include "vip_slam_frontend/filter/shared_depth.h"
#include "vip_slam_frontend/filter/triangulation.h"

namespace vip_slam {

namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Householder reflections of the rows begin .. end that leave the three columns from `feature` on upper triangular.
/// The columns before `column` are zero in these rows; `stride` leaves room for a pack beyond `width`.
VIP_SLAM_VECTOR_CLONES
void eliminateFeature(double* A, long stride, int width, int feature, int begin, int end, int column) {
  for (int pivot = 0; pivot < 3 && begin + pivot < end; ++pivot) {
    double* head = A + (begin + pivot) * stride;
    double* const last = A + end * stride;
    double tail2 = 0;
    for (double* row = head + stride; row < last; row += stride) tail2 += row[feature + pivot] * row[feature + pivot];
    if (tail2 == 0.0) continue;
    const double alpha = head[feature + pivot], beta = std::sqrt(alpha * alpha + tail2);
    // (alpha - beta) without cancellation
    const double v0 = alpha <= 0 ? alpha - beta : -tail2 / (alpha + beta);
    const double tau = 2.0 / (tail2 + v0 * v0);
    double v[5];  // a view has up to three rows, and the views after it pass on up to three
    int rows = 0;
    for (double* row = head + stride; row < last; row += stride) v[rows++] = row[feature + pivot];
    for (int c = column; c < width; c += 4) {
      Pack sum = spread(v0) * load(head + c);
      for (int k = 0; k < rows; ++k) sum += spread(v[k]) * load(head + (k + 1) * stride + c);
      sum *= spread(tau);
      store(head + c, load(head + c) - spread(v0) * sum);
      for (int k = 0; k < rows; ++k) {
        double* x = head + (k + 1) * stride + c;
        store(x, load(x) - spread(v[k]) * sum);
      }
    }
    for (double* row = head + stride; row < last; row += stride) row[feature + pivot] = 0.0;
  }
}

}  // namespace

std::vector<ViewRows> stackFeature(const WindowState& window, const std::vector<Observation>& observations,
                                   const Eigen::Vector3d& f_W, const MeasurementNoise& noise, Eigen::MatrixXd* H_x,
                                   Eigen::MatrixXd* H_f, Eigen::VectorXd* r) {
  const int most = 3 * static_cast<int>(observations.size());
  *H_x = Eigen::MatrixXd::Zero(most, window.dimension());
  *H_f = Eigen::MatrixXd::Zero(most, 3);
  *r = Eigen::VectorXd::Zero(most);
  const Eigen::Matrix3d R_C_I = window.T_I_C.R().transpose();
  std::vector<ViewRows> views;
  std::vector<frontend::DepthRow> depths;
  int row = 0;
  for (const Observation& o : observations) {
    const int index = window.indexOf(o.clone);
    if (index < 0) continue;
    const Clone& clone = window.clones[index];

    const Eigen::Vector3d p_C = cameraPose(window, clone).inverse() * f_W;
    const Eigen::Matrix3d R_I_W = clone.T_W_I_fej.R().transpose();
    const Eigen::Vector3d q_I = R_I_W * (f_W - clone.T_W_I_fej.t());
    const Eigen::Vector3d q_C = R_C_I * (q_I - window.T_I_C.t());
    if (p_C.z() < 0.02 || q_C.z() < 0.02) continue;

    // d p_C / d(theta, p, f)
    const Eigen::Matrix3d J_theta = R_C_I * hat(q_I);
    const Eigen::Matrix3d J_f = R_C_I * R_I_W;
    const bool with_depth = noise.use_depth && o.depth > 0;
    const int rows = with_depth ? 3 : 2;
    Eigen::Matrix3d J_measure;  // d(x, y, z) / d p_C, whitened
    const double iz = 1.0 / q_C.z();
    J_measure << iz, 0, -q_C.x() * iz * iz, 0, iz, -q_C.y() * iz * iz, 0, 0, 1;
    const double sigma_z = with_depth ? o.depth_sigma * noise.depth_inflation : 1.0;
    Eigen::Matrix3d weight = Eigen::Matrix3d::Zero();
    weight.topLeftCorner<2, 2>() = o.whitening / noise.sigma_xy;
    weight(2, 2) = 1.0 / sigma_z;
    J_measure = weight * J_measure;

    const Eigen::Vector2d xy = trueBearing(window, o);
    Eigen::Vector3d residual(xy.x() - p_C.x() / p_C.z(), xy.y() - p_C.y() / p_C.z(), trueDepth(window, o) - p_C.z());
    residual = weight * residual;

    const Eigen::Matrix3d M_theta = J_measure * J_theta, M_f = J_measure * J_f;
    const int column = window.cloneColumn(index);
    views.push_back({row, column});
    H_x->block(row, column, rows, 3) = M_theta.topRows(rows);
    H_x->block(row, column + 3, rows, 3) = -M_f.topRows(rows);
    H_f->middleRows(row, rows) = M_f.topRows(rows);
    if (window.calibration.rotation) {
      H_x->block(row, window.rotationColumn(), rows, 3) = (J_measure * hat(q_C)).topRows(rows);
    }
    if (window.calibration.translation) {
      H_x->block(row, window.translationColumn(), rows, 3) = -(J_measure * R_C_I).topRows(rows);
    }
    if (window.calibration.time_offset) {
      H_x->block(row, window.timeOffsetColumn(), rows, 1) = (M_theta * clone.omega_I - M_f * clone.v_W).topRows(rows);
    }
    // Sign: the offset is added to the measured depth, whereas the other columns are Jacobians of the predicted one.
    if (window.calibration.depth_offset && with_depth) (*H_x)(row + 2, window.depthOffsetColumn()) = -1.0 / sigma_z;
    if (window.calibration.depth_scale && with_depth) (*H_x)(row + 2, window.depthScaleColumn()) = -q_C.z() / sigma_z;
    if (window.calibration.depth_delay && with_depth)
      (*H_x)(row + 2, window.depthDelayColumn()) = -o.depth_rate / sigma_z;
    if (window.calibration.readout)
      H_x->block<2, 1>(row, window.readoutColumn()) = -weight.topLeftCorner<2, 2>() * o.by_readout;
    if (window.calibration.intrinsics) {
      // Evaluated at the predicted bearing: the measured one has the residual's noise, and its square would bias the
      // focal length (by 0.25 % with 0.2 px).
      BearingJacobian by_intrinsics = o.by_intrinsics;
      by_intrinsics.leftCols<2>() += (q_C.head<2>() / q_C.z() - xy).asDiagonal();
      H_x->block<2, 4>(row, window.intrinsicsColumn()) = -weight.topLeftCorner<2, 2>() * by_intrinsics;
    }
    if (window.calibration.depth_shift && with_depth)
      H_x->block<1, 2>(row + 2, window.depthShiftColumn()) = -o.depth_slope.transpose() / sigma_z;
    r->segment(row, rows) = residual.head(rows);
    if (with_depth) depths.push_back({row + 2, o.depth_shared / sigma_z, o.xy});
    row += rows;
  }
  frontend::decorrelateDepth(depths, H_x, H_f, r);
  H_x->conservativeResize(row, Eigen::NoChange);
  H_f->conservativeResize(row, Eigen::NoChange);
  r->conservativeResize(row);
  return views;
}

FeatureRows featureRows(const WindowState& window, const std::vector<Observation>& observations,
                        const Eigen::Vector3d& f_W, const MeasurementNoise& noise) {
  Eigen::MatrixXd H_x, H_f;
  Eigen::VectorXd r;
  const std::vector<ViewRows> views = stackFeature(window, observations, f_W, noise, &H_x, &H_f, &r);
  FeatureRows result;
  const int rows = static_cast<int>(r.size());
  if (rows <= 3) return result;
  const int nav = window.navColumn(), width = nav + 4;
  RowMajor A = RowMajor::Zero(rows, width + 4);
  A.leftCols(nav) = H_x.leftCols(nav);
  A.middleCols<3>(nav) = H_f;
  A.col(nav + 3) = r;
  // From the last view to the first: the three rows that contain the feature are passed on to the view before; the rows
  // free of it stay and keep their zeros for the clones before their view.
  int below = 0;  // rows that contain the feature in the views done so far
  for (int i = static_cast<int>(views.size()) - 1; i >= 0; --i) {
    const int begin = views[i].begin, next = i + 1 < static_cast<int>(views.size()) ? views[i + 1].begin : rows;
    eliminateFeature(A.data(), A.cols(), width, nav, begin, next + below, views[i].column);
    below = std::min(3, next + below - begin);
  }
  result.H = Eigen::MatrixXd::Zero(rows - 3, window.dimension());
  result.H.leftCols(nav) = A.block(3, 0, rows - 3, nav);
  result.r = A.col(nav + 3).tail(rows - 3);
  return result;
}

}  // namespace vip_slam
