// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/association/consistency_test.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "vip_slam_core/util/significance.h"

namespace vip_slam {
namespace {

// Gauss-Newton over p = p0 + B x, B with 3 columns (free) or 2 (on the plane).
template <int N>
bool estimate(const std::vector<PointSighting>& sightings, const Eigen::Matrix<double, 3, N>& B, double focal,
              double least_pixel_sigma, Eigen::Vector3d* p, Eigen::Matrix<double, N, N>* information) {
  using MatrixN = Eigen::Matrix<double, N, N>;
  using VectorN = Eigen::Matrix<double, N, 1>;
  // Until the steps are small, or no longer converge.
  for (double last = std::numeric_limits<double>::infinity();;) {
    MatrixN H = MatrixN::Zero();
    VectorN g = VectorN::Zero();
    const auto addRow = [&](const Eigen::RowVector3d& J, double r) {
      const double w = std::abs(r) > kNoiseSigmas ? kNoiseSigmas / std::abs(r) : 1.0;
      const Eigen::Matrix<double, 1, N> row = J * B;
      H.noalias() += w * row.transpose() * row;
      g.noalias() += w * row.transpose() * r;
    };
    for (const PointSighting& s : sightings) {
      const Eigen::Vector3d q = s.T_C_map * *p;
      if (q.z() < 0.05) return false;
      const Eigen::Matrix3d R = s.T_C_map.R();
      const double iz = 1.0 / q.z(), sigma_xy = std::max(s.pixel_sigma, least_pixel_sigma) / focal;
      addRow((R.row(0) - q.x() * iz * R.row(2)) * iz / sigma_xy, (q.x() * iz - s.xy.x()) / sigma_xy);
      addRow((R.row(1) - q.y() * iz * R.row(2)) * iz / sigma_xy, (q.y() * iz - s.xy.y()) / sigma_xy);
      if (s.depth > 0) addRow(R.row(2) / s.depth_sigma, (q.z() - s.depth) / s.depth_sigma);
    }
    *information = H;
    const VectorN step = -(H + 1e-9 * H.trace() * MatrixN::Identity()).ldlt().solve(g);
    if (!step.allFinite()) return false;
    *p += B * step;
    const double length = step.norm();
    if (length < 1e-5 || !(2 * length < last)) break;
    last = length;
  }
  return p->allFinite();
}

bool reprojectionErrors(const std::vector<PointSighting>& sightings, const Eigen::Vector3d& p, double focal,
                        double* rms, double* worst) {
  double sum = 0;
  *worst = 0;
  for (const PointSighting& s : sightings) {
    const Eigen::Vector3d q = s.T_C_map * p;
    if (q.z() < 0.05) return false;
    const double e2 = (q.head<2>() / q.z() - s.xy).squaredNorm() * focal * focal;
    sum += e2;
    *worst = std::max(*worst, std::sqrt(e2));
  }
  *rms = std::sqrt(sum / double(sightings.size()));
  return true;
}

}  // namespace

ConsistencyResult testConsistency(const std::vector<PointSighting>& sightings, const Plane& plane,
                                  const Eigen::Vector3d& start, double focal, const PointAssociationOptions& options) {
  ConsistencyResult result;
  if (sightings.size() < 2) return result;
  Eigen::Vector3d free = start;
  Eigen::Matrix3d information;
  const Eigen::Matrix3d everywhere = Eigen::Matrix3d::Identity();
  if (!estimate<3>(sightings, everywhere, focal, options.pixel_sigma, &free, &information)) return result;
  Eigen::Vector3d forced = plane.project(free);
  Eigen::Matrix2d unused;
  if (!estimate<2>(sightings, tangentBasis(plane.n), focal, options.pixel_sigma, &forced, &unused)) return result;
  double max_free = 0;
  if (!reprojectionErrors(sightings, free, focal, &result.rms_free, &max_free) ||
      !reprojectionErrors(sightings, forced, focal, &result.rms_forced, &result.max_forced)) {
    return result;
  }
  result.solved = true;
  result.distance = std::abs(plane.signedDistance(free));
  const double scale = std::max(1.0, information.trace());
  const Eigen::Matrix3d covariance = (information + 1e-12 * scale * Eigen::Matrix3d::Identity()).inverse();
  result.distance_sigma = std::sqrt(std::max(0.0, plane.n.dot(covariance * plane.n)));
  result.consistent = result.rms_forced <= result.rms_free + options.similar_px &&
                      result.max_forced <= options.max_error_px &&
                      result.distance <= options.max_distance + std::min(options.max_distance, result.distance_sigma);
  return result;
}

}  // namespace vip_slam
