// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/detection/plane_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

namespace vip_slam {
namespace {

// Accumulates PlaneMoments of many points: only the matrix's upper triangle, kept in registers.
class MomentSum {
 public:
  void add(const Eigen::Vector3d& p, double w) {
    const double wx = w * p.x(), wy = w * p.y(), wz = w * p.z();
    w_ += w, x_ += wx, y_ += wy, z_ += wz;
    xx_ += wx * p.x(), xy_ += wy * p.x(), xz_ += wz * p.x();
    yy_ += wy * p.y(), yz_ += wz * p.y(), zz_ += wz * p.z();
  }
  PlaneMoments moments() const {
    PlaneMoments m;
    m.M << xx_, xy_, xz_, x_, xy_, yy_, yz_, y_, xz_, yz_, zz_, z_, x_, y_, z_, w_;
    return m;
  }

 private:
  double w_ = 0, x_ = 0, y_ = 0, z_ = 0, xx_ = 0, xy_ = 0, xz_ = 0, yy_ = 0, yz_ = 0, zz_ = 0;
};

}  // namespace

double PlaneMoments::meanSquare(const Plane& plane) const {
  const Eigen::Vector4d pi = plane.coefficients();
  return weight() > 0 ? std::max(0.0, pi.dot(M * pi) / weight()) : 0.0;
}

double PlaneMoments::spread() const {
  const Eigen::Vector3d mean = centroid();
  const Eigen::Matrix3d scatter = M.topLeftCorner<3, 3>() / weight() - mean * mean.transpose();
  return std::sqrt(std::max(1e-12, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues()(1)));
}

PlaneMoments PlaneMoments::transformed(const SE3& T) const {
  const Eigen::Matrix4d A = T.matrix();
  return {A * M * A.transpose()};
}

bool fitPlane(const PlaneMoments& moments, PlaneKind kind, const Eigen::Vector3d& towards, Plane* plane) {
  if (!(moments.weight() > 0)) return false;
  const Eigen::Vector3d mean = moments.centroid();
  Eigen::Vector3d n;
  if (kind == PlaneKind::kHorizontal) {
    n = Eigen::Vector3d::UnitZ();
  } else {
    const Eigen::Matrix3d scatter = moments.M.topLeftCorner<3, 3>() / moments.weight() - mean * mean.transpose();
    if (kind == PlaneKind::kVertical) {
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(scatter.topLeftCorner<2, 2>());
      if (!(solver.eigenvalues()(1) > 1e-8)) return false;
      n << solver.eigenvectors().col(0), 0.0;
    } else {
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
      if (!(solver.eigenvalues()(1) > 1e-8)) return false;
      n = solver.eigenvectors().col(0);
    }
  }
  if (n.dot(towards) < 0) n = -n;
  *plane = Plane::fromPointNormal(mean, n);
  return true;
}

bool fitLeaningPlane(const PlaneMoments& moments, PlaneKind kind, double lean_sigma, const Eigen::Vector3d& towards,
                     Plane* plane) {
  if (!fitPlane(moments, kind, towards, plane)) return false;
  if (kind == PlaneKind::kGeneral || !(lean_sigma > 0)) return true;
  // The square of a small lean is n_z^2 or n_x^2 + n_y^2, so that the prior is a quadratic form like the scatter.
  const Eigen::Vector3d mean = moments.centroid(), z = Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d across = kind == PlaneKind::kVertical ? Eigen::Matrix3d(z * z.transpose())
                                                              : Eigen::Matrix3d::Identity() - z * z.transpose();
  const Eigen::Matrix3d scatter = moments.M.topLeftCorner<3, 3>() - moments.weight() * mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter + across / (lean_sigma * lean_sigma));
  const Eigen::Vector3d n = solver.eigenvectors().col(0);
  *plane = Plane::fromPointNormal(mean, n.dot(plane->n) < 0 ? Eigen::Vector3d(-n) : n);
  return true;
}

double normalSigma(const PlaneMoments& moments, PlaneKind kind) {
  if (!(moments.weight() > 0)) return std::numeric_limits<double>::infinity();
  if (kind == PlaneKind::kHorizontal) return 0;
  const Eigen::Vector3d mean = moments.centroid();
  const Eigen::Matrix3d scatter = moments.M.topLeftCorner<3, 3>() - moments.weight() * mean * mean.transpose();
  double information;  // sum w x^2 about the axis with the least lever arm for a rotation
  if (kind == PlaneKind::kVertical) {
    information = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(scatter.topLeftCorner<2, 2>()).eigenvalues()(1);
  } else {
    information = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues()(1);
  }
  return information > 0 ? 1.0 / std::sqrt(information) : std::numeric_limits<double>::infinity();
}

bool fitPlaneRobust(const std::vector<Eigen::Vector3d>& points, const std::vector<double>& weights, double sigma,
                    PlaneKind kind, const Eigen::Vector3d& towards, Plane* plane, double* rms) {
  constexpr int kRounds = 8, kAbsolute = 4;  // least absolute distances first: Tukey needs a start near the majority
  constexpr double kTukey = 4.685;
  std::vector<double> residuals(points.size()), sorted;
  MomentSum sum;
  for (std::size_t i = 0; i < points.size(); ++i) sum.add(points[i], weights[i]);
  for (int round = 0; round < kRounds; ++round) {
    if (!fitPlane(sum.moments(), kind, towards, plane)) return false;
    for (std::size_t i = 0; i < points.size(); ++i) residuals[i] = std::abs(plane->signedDistance(points[i]));
    sorted = residuals;
    std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
    const double scale = std::max(sigma, 1.4826 * sorted[sorted.size() / 2]), cut = kTukey * scale;
    sum = MomentSum();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (round < kAbsolute) {
        sum.add(points[i], weights[i] * scale / std::max(0.2 * scale, residuals[i]));
        continue;
      }
      const double x = residuals[i] / cut;
      if (x < 1) sum.add(points[i], weights[i] * (1 - x * x) * (1 - x * x));
    }
  }
  if (!fitPlane(sum.moments(), kind, towards, plane)) return false;
  if (rms) *rms = std::sqrt(sum.moments().meanSquare(*plane));
  return true;
}

}  // namespace vip_slam
