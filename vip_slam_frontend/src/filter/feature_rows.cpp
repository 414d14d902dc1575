#include "vip_slam_frontend/filter/feature_rows.h"

#include "vip_slam_frontend/filter/qr.h"
#include "vip_slam_frontend/filter/triangulation.h"

namespace vip_slam {

void stackFeature(const WindowState& window, const std::vector<Observation>& observations, const Eigen::Vector3d& f_W,
                  const MeasurementNoise& noise, Eigen::MatrixXd* H_x, Eigen::MatrixXd* H_f, Eigen::VectorXd* r) {
  const int most = 3 * static_cast<int>(observations.size());
  *H_x = Eigen::MatrixXd::Zero(most, window.dimension());
  *H_f = Eigen::MatrixXd::Zero(most, 3);
  *r = Eigen::VectorXd::Zero(most);
  const Eigen::Matrix3d R_C_I = window.T_I_C.R().transpose();
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

    Eigen::Vector3d residual(o.xy.x() - p_C.x() / p_C.z(), o.xy.y() - p_C.y() / p_C.z(), o.depth - p_C.z());
    residual = weight * residual;

    const Eigen::Matrix3d M_theta = J_measure * J_theta, M_f = J_measure * J_f;
    const int column = window.cloneColumn(index);
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
    r->segment(row, rows) = residual.head(rows);
    row += rows;
  }
  H_x->conservativeResize(row, Eigen::NoChange);
  H_f->conservativeResize(row, Eigen::NoChange);
  r->conservativeResize(row);
}

FeatureRows featureRows(const WindowState& window, const std::vector<Observation>& observations,
                        const Eigen::Vector3d& f_W, const MeasurementNoise& noise) {
  Eigen::MatrixXd H_x, H_f;
  Eigen::VectorXd r;
  stackFeature(window, observations, f_W, noise, &H_x, &H_f, &r);
  FeatureRows result;
  const int rows = static_cast<int>(r.size());
  if (rows <= 3) return result;
  const int n = window.dimension();
  Eigen::MatrixXd A(rows, 3 + n + 1);
  A.leftCols(3) = H_f;
  A.middleCols(3, n) = H_x;
  A.col(3 + n) = r;
  triangularise(A, 3);
  result.H = A.block(3, 3, rows - 3, n);
  result.r = A.col(3 + n).tail(rows - 3);
  return result;
}

}  // namespace vip_slam
