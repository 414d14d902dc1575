// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/triangulation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam {

namespace {

struct View {
  Eigen::Matrix3d R;  // R_C_A: anchor into this camera
  Eigen::Vector3d t;
  const Observation* observation;
  Eigen::Vector2d xy;  // corrected bearing of the observation
};

/// Median z in the anchor of the depth readings, each transformed as a point on its own ray; 0 when there are none.
double depthInAnchor(const WindowState& window, const std::vector<View>& views) {
  std::vector<double> z;
  for (const View& view : views) {
    const Observation& o = *view.observation;
    if (o.depth <= 0) continue;
    const Eigen::Vector3d p_C = trueDepth(window, o) * view.xy.homogeneous();
    z.push_back((view.R.transpose() * (p_C - view.t)).z());
  }
  return z.empty() ? 0.0 : upperMedian(std::move(z));
}

/// z in the anchor along the anchor's ray by least squares over all views (point on the ray nearest to all rays).
double depthFromRays(const std::vector<View>& views) {
  const Eigen::Vector3d ray = views.front().xy.homogeneous();
  double a = 0, b = 0;
  for (std::size_t i = 1; i < views.size(); ++i) {
    const Eigen::Vector3d m = views[i].xy.homogeneous();
    // m x (R ray z + t) = 0
    const Eigen::Vector3d u = m.cross(views[i].R * ray), w = m.cross(views[i].t);
    a += u.squaredNorm();
    b -= u.dot(w);
  }
  return a > 1e-12 ? b / a : 0.0;
}

}  // namespace

BearingJacobian bearingJacobian(const Eigen::Vector2d& xy) {
  BearingJacobian J;
  J << xy.x(), 0, 1, 0, 0, xy.y(), 0, 1;
  return J;
}

BearingJacobian bearingJacobian(const CameraModel& camera, const Eigen::Vector2d& xy) {
  const CameraIntrinsics& k = camera.intrinsics();
  const Eigen::Vector2d focal(k.fx, k.fy);
  Eigen::Matrix2d bend;
  const Eigen::Vector2d distorted = (camera.distort(xy, &bend) - Eigen::Vector2d(k.cx, k.cy)).cwiseQuotient(focal);
  return bend.inverse() * focal.asDiagonal() * bearingJacobian(distorted);
}

Eigen::Vector2d bearingRate(const Eigen::Vector2d& xy, double z, const Eigen::Vector3d& omega_C,
                            const Eigen::Vector3d& v_C) {
  const Eigen::Vector3d moved = -omega_C.cross(z * xy.homogeneous()) - v_C;
  return (moved.head<2>() - xy * moved.z()) / z;
}

double depthRate(const Eigen::Vector2d& xy, double z, const Eigen::Vector2d& slope, const Eigen::Vector3d& omega_C,
                 const Eigen::Vector3d& v_C) {
  const Eigen::Vector3d moved = -omega_C.cross(z * xy.homogeneous()) - v_C;
  return moved.z() - slope.dot(bearingRate(xy, z, omega_C, v_C));
}

SE3 cameraPose(const WindowState& window, const Clone& clone) {
  const double shift = window.time_offset - clone.time_offset;
  if (shift == 0.0) return clone.T_W_I * window.T_I_C;
  Vector6d delta;
  delta << clone.omega_I * shift, clone.v_W * shift;
  return clone.T_W_I.boxplus(delta) * window.T_I_C;
}

Triangulation triangulate(const WindowState& window, const std::vector<Observation>& observations,
                          const MeasurementNoise& noise) {
  Triangulation result;
  std::vector<View> views;
  views.reserve(observations.size());
  SE3 T_W_A;
  for (const Observation& o : observations) {
    const int index = window.indexOf(o.clone);
    if (index < 0) continue;
    const SE3 T_W_C = cameraPose(window, window.clones[index]);
    if (views.empty()) T_W_A = T_W_C;
    const SE3 T_C_A = T_W_C.inverse() * T_W_A;
    views.push_back({T_C_A.R(), T_C_A.t(), &o, trueBearing(window, o)});
  }
  if (views.size() < 2) return result;

  double z = noise.use_depth ? depthInAnchor(window, views) : 0.0;
  if (z <= 0) z = depthFromRays(views);
  if (!(z > 0.05) || !(z < 200.0)) return result;

  Eigen::Vector3d x(views.front().xy.x(), views.front().xy.y(), 1.0 / z);
  Eigen::Matrix3d A;
  double last_cost = 1e300;
  double lambda = 1e-6;
  constexpr int kSteps = 8;  // at most; what the last one leads to is evaluated as well
  // What was evaluated last without being refused; only that is returned.
  Eigen::Vector3d x_good = x;
  Eigen::Matrix3d A_good;
  Triangulation good;
  for (int iteration = 0; iteration <= kSteps; ++iteration) {
    A.setZero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double cost = 0;
    bool valid = x.z() > 1e-3;
    result.depth_rows = result.pixel_rows = 0;
    result.pixel_chi2 = result.depth_chi2 = 0;
    for (const View& view : views) {
      // rho p_C = R (alpha, beta, 1) + rho t
      const Eigen::Vector3d s = view.R * Eigen::Vector3d(x.x(), x.y(), 1.0) + x.z() * view.t;
      if (s.z() < 1e-3) {
        valid = false;
        break;
      }
      Eigen::Matrix3d ds;
      ds << view.R.col(0), view.R.col(1), view.t;
      const Eigen::Vector2d predicted(s.x() / s.z(), s.y() / s.z());
      const Eigen::Matrix2d L = view.observation->whitening / noise.sigma_xy;
      const Eigen::Vector2d r = L * (view.xy - predicted);
      Eigen::Matrix<double, 2, 3> J;
      J.row(0) = (ds.row(0) - predicted.x() * ds.row(2)) / s.z();
      J.row(1) = (ds.row(1) - predicted.y() * ds.row(2)) / s.z();
      J = L * J;
      const double e2 = r.squaredNorm();
      const double w = e2 > 9.0 ? 3.0 / std::sqrt(e2) : 1.0;
      A += w * J.transpose() * J;
      b += w * J.transpose() * r;
      cost += w * e2;
      result.pixel_chi2 += e2;
      result.pixel_rows += 2;
      if (noise.use_depth && view.observation->depth > 0) {
        const double sigma = view.observation->depth_sigma * noise.depth_inflation;
        const double z_C = s.z() / x.z();
        const double rz = (trueDepth(window, *view.observation) - z_C) / sigma;
        Eigen::RowVector3d Jz = ds.row(2) / x.z();
        Jz.z() -= s.z() / (x.z() * x.z());
        Jz /= sigma;
        const double wz = std::abs(rz) > 3.0 ? 3.0 / std::abs(rz) : 1.0;
        A += wz * Jz.transpose() * Jz;
        b += wz * Jz.transpose() * rz;
        cost += wz * rz * rz;
        result.depth_chi2 += rz * rz;
        ++result.depth_rows;
      }
    }
    if (!valid || cost > last_cost) {
      if (iteration == 0) return result;
      lambda = std::max(lambda * 100.0, 1e-4);
      x = x_good;
      last_cost = 1e300;
      continue;
    }
    x_good = x;
    A_good = A;
    good = result;
    const bool settled = last_cost - cost < 1e-6 * cost;
    last_cost = cost;
    if (settled || iteration == kSteps) break;
    Eigen::Matrix3d damped = A;
    damped.diagonal() *= 1.0 + lambda;
    const Eigen::Vector3d step = damped.ldlt().solve(b);
    if (!step.allFinite()) return result;
    x += step;
    if (step.norm() < 1e-7) {
      x_good = x;  // as good as evaluated
      break;
    }
  }
  x = x_good;
  result = good;
  const Eigen::Matrix3d covariance = A_good.inverse();
  result.inverse_depth = x.z();
  result.sigma_inverse_depth = std::sqrt(std::max(0.0, covariance(2, 2)));
  result.p_W = T_W_A * Eigen::Vector3d(x.x() / x.z(), x.y() / x.z(), 1.0 / x.z());
  result.ok = result.p_W.allFinite() && x.z() > 1e-3 && x.z() < 20.0;
  // Without depth a distant point has no information about translation and linearises poorly.
  if (result.depth_rows == 0 && result.sigma_inverse_depth > 0.5 * result.inverse_depth) result.ok = false;
  return result;
}

}  // namespace vip_slam
