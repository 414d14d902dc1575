// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/factors/homography.h"

#include <cmath>

#include <Eigen/Eigenvalues>

namespace vip_slam {

Vector9d homographyVector(const FrameGeometry& i, const FrameGeometry& j, const Plane& plane,
                          const Eigen::Matrix<double, 3, 2>* basis, HomographyJacobian* J) {
  const Eigen::Vector3d& n = plane.n;
  const Eigen::Vector3d a = i.t_W_C - j.t_W_C;
  const double D = plane.d + n.dot(i.t_W_C), inv_D = 1.0 / D;
  const Eigen::Vector3d b = j.R_C_W * a;          // R_j^T a
  const Eigen::Vector3d m = i.R_C_W * n * inv_D;  // R_i^T n / D
  const Eigen::Matrix3d R_ji = j.R_C_W * i.R_C_W.transpose();
  const Eigen::Matrix3d H = R_ji - b * m.transpose();
  Vector9d h;
  h << H(0, 0), H(0, 1), H(0, 2), H(1, 0), H(1, 1), H(1, 2), H(2, 0), H(2, 1), H(2, 2);
  if (!J) return h;

  // Camera tangents first: theta_i: row r of dH/dtheta_k = (row r of H) x' ... = H [e_k]x; theta_j: -[e_k]x H.
  Eigen::Matrix<double, 9, 3> J_ti, J_tj, J_thi, J_thj;
  for (int r = 0; r < 3; ++r) J_thi.middleRows<3>(3 * r) = hat(H.row(r).transpose());
  const Eigen::Matrix3d& Rj = j.R_C_W;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const int row = 3 * r + c;
      // -[e_k]x H, entry (r, c): ([H_c]x)_{r k} with H_c the c-th column.
      const Eigen::Vector3d col = H.col(c);
      if (r == 0) J_thj.row(row) << 0, -col.z(), col.y();
      if (r == 1) J_thj.row(row) << col.z(), 0, -col.x();
      if (r == 2) J_thj.row(row) << -col.y(), col.x(), 0;
      J_tj.row(row) = m(c) * Rj.row(r);
      // R_j^T M e_k = Rj e_k - b n_k / D.
      J_ti.row(row) = -m(c) * (Rj.row(r) - b(r) * inv_D * n.transpose());
    }
  // To IMU tangents: dtheta_C = R_C_I dtheta_I, dt_C = dt_I - R_W_I [t_I_C]x dtheta_I.
  J->middleCols<3>(3) = J_ti;
  J->middleCols<3>(9) = J_tj;
  J->middleCols<3>(0) = J_thi * i.R_C_I - J_ti * (i.R_W_I * hat(i.t_I_C));
  J->middleCols<3>(6) = J_thj * j.R_C_I - J_tj * (j.R_W_I * hat(j.t_I_C));
  // Plane: dn: -b (R_i^T (dn/D - n (dn.t_i)/D^2))^T;  dd: b m^T / D.
  const Eigen::Matrix<double, 3, 2>& B = *basis;
  const Eigen::Matrix<double, 3, 2> K = i.R_C_W * B * inv_D - m * (i.t_W_C.transpose() * B) * inv_D;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      J->block<1, 2>(3 * r + c, 12) = -b(r) * K.row(c);
      (*J)(3 * r + c, 14) = b(r) * m(c) * inv_D;
    }
  return h;
}

double hostNoiseGain(const Vector9d& h, const Eigen::Vector3d& p) {
  const double inverse = 1.0 / p.z(), u = p.x() * inverse, v = p.y() * inverse;
  const double a = h(0) - u * h(6), b = h(1) - u * h(7), c = h(3) - v * h(6), d = h(4) - v * h(7);
  return 0.5 * inverse * inverse * (a * a + b * b + c * c + d * d);
}

Eigen::Matrix<double, 2, 9> homographyRows(const HomographyPair& pair) {
  const double x = pair.xy_i.x(), y = pair.xy_i.y(), u = pair.xy_j.x(), v = pair.xy_j.y();
  Eigen::Matrix<double, 2, 9> C;
  C << x, y, 1, 0, 0, 0, -x * u, -y * u, -u, 0, 0, 0, x, y, 1, -x * v, -y * v, -v;
  return pair.weight * C;
}

void addHomographyPair(const HomographyPair& pair, HomographySums* sums) {
  const double x = pair.xy_i.x(), y = pair.xy_i.y(), u = pair.xy_j.x(), v = pair.xy_j.y();
  const double w = pair.weight * pair.weight;
  const double products[6] = {x * x, x * y, x, y * y, y, 1.0};
  const double weights[4] = {w, w * u, w * v, w * (u * u + v * v)};
  double* s = sums->data();
  for (const double weight : weights)
    for (const double product : products) *s++ += weight * product;
}

Matrix9d homographyMatrix(const HomographySums& sums) {
  const auto block = [&](int k) {
    const double* s = sums.data() + 6 * k;
    Eigen::Matrix3d M;
    M << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
    return M;
  };
  const Eigen::Matrix3d A = block(0), B = block(1), C = block(2), Z = Eigen::Matrix3d::Zero();
  Matrix9d G;
  G << A, Z, -B, Z, A, -C, -B, -C, block(3);
  return G;
}

bool isFinite(const HomographySums& sums) {
  for (const double s : sums)
    if (!std::isfinite(s)) return false;
  return true;
}

int decomposeHomography(const Matrix9d& G, Matrix9d* rows) {
  const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(G);
  const Vector9d& lambda = eigen.eigenvalues();
  const double smallest = 1e-12 * std::max(lambda(8), 0.0);
  int count = 0;
  rows->setZero();
  for (int k = 8; k >= 0; --k)
    if (lambda(k) > smallest) rows->row(count++) = std::sqrt(lambda(k)) * eigen.eigenvectors().col(k).transpose();
  return count;
}

}  // namespace vip_slam
