// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/geometry/plane_noise.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Eigenvalues>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr std::size_t kMinObservations = 30;
constexpr double kMedian = 2.366;  // of a chi square with three degrees of freedom
// The typical misfit is at least a twenty-fifth of the noise model's: planes and poses are fitted to the same points,
// so that the residuals of a map with few planes are too small.
constexpr double kMaxReduction = 25.0;
// Prior degrees of freedom of a plane's variance: as if four observations had confirmed that it is one surface.
constexpr double kPlaneFreedom = 12.0;
// Least observations for a decision on a plane, and the factor by which their median must exceed that of the map.
constexpr std::size_t kMinOfPlane = 4;
constexpr double kDisagrees = 10.0;
// Unevenness of a real wall, one sigma: one that bows by a centimetre over its length still counts as one plane,
// however accurate the map.
constexpr double kSurfaceSigma = 0.006;  // m

/// The median misfit relative to the noise model's, at least 1 / kMaxReduction: smaller values are due to overfitting.
double typicalMisfit(std::vector<double> misfits) {
  return std::max(upperMedian(std::move(misfits)) / kMedian, 1.0 / kMaxReduction);
}

double typicalMisfit(const std::vector<PlaneMisfit>& misfits) {
  std::vector<double> all;
  all.reserve(misfits.size());
  for (const PlaneMisfit& m : misfits) all.push_back(m.misfit);
  return typicalMisfit(std::move(all));
}

}  // namespace

SurfaceNoise surfaceNoise(const Eigen::Matrix4d& G, std::size_t count, const Eigen::Vector3d& n_C,
                          const DepthNoise& model, const DepthNoiseParts& parts) {
  const double weight = G(3, 3);
  if (!(weight > 0) || count == 0) return {};
  const Eigen::Vector3d centre = G.topRightCorner<3, 1>() / weight;
  if (!(centre.z() > 0)) return {};
  const double sigma = model.sigma(centre.z()) * n_C.dot(centre) / centre.z(), reading = sigma * sigma;
  if (!(reading > 0)) return {};
  // The samples' own variance, on average, is their number over the sum of their weights.
  return {parts.white * reading * weight / static_cast<double>(count), parts.shared * reading};
}

Eigen::Matrix4d sharedErrorShrinkage(const Eigen::Matrix4d& G, double shared) {
  const double weight = G(3, 3);
  if (!(weight > 0)) return Eigen::Matrix4d::Identity();
  const Eigen::Vector3d centre = G.topRightCorner<3, 1>() / weight;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(Eigen::Matrix3d(G.topLeftCorner<3, 3>() - weight * centre * centre.transpose()));
  const Eigen::Vector3d n = eigen.eigenvectors().col(0);
  const double distance = 1 / std::sqrt(1 + weight * shared), turn = 1 / std::sqrt(1 + weight * shared / 3);
  Eigen::Matrix4d T = Eigen::Matrix4d::Zero();
  T.topLeftCorner<3, 3>() = turn * (Eigen::Matrix3d::Identity() - n * n.transpose());
  T.topRightCorner<3, 1>() = distance * centre - T.topLeftCorner<3, 3>() * centre;
  T(3, 3) = distance;
  return T;
}

double planeMisfit(const Eigen::Matrix4d& G, const Eigen::Vector4d& plane_C) {
  const double weight = G(3, 3);
  if (!(weight > 0)) return 0;
  const Eigen::Vector3d centre = G.topRightCorner<3, 1>() / weight;
  const Eigen::Matrix3d scatter = G.topLeftCorner<3, 3>() - weight * centre * centre.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(scatter, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d n = plane_C.head<3>();
  const double distance = n.dot(centre) + plane_C(3), tilt = n.dot(scatter * n) - eigen.eigenvalues()(0);
  return weight * distance * distance + std::max(0.0, tilt);
}

std::vector<double> planeWeights(const std::vector<PlaneMisfit>& misfits, std::size_t planes) {
  std::vector<double> weights(planes, 1.0);
  if (misfits.size() < kMinObservations) return weights;
  const double unit = typicalMisfit(misfits);
  std::vector<double> expected(planes, kPlaneFreedom), found(planes, kPlaneFreedom);
  for (const PlaneMisfit& m : misfits) {
    expected[m.plane] += 3.0;
    found[m.plane] += m.misfit / unit;
  }
  for (std::size_t p = 0; p < planes; ++p) weights[p] = std::min(1.0, expected[p] / found[p]);
  return weights;
}

std::vector<char> planesAgree(const std::vector<PlaneMisfit>& misfits, std::size_t planes) {
  std::vector<char> agree(planes, 1);
  if (misfits.size() < kMinObservations) return agree;
  const double unit = typicalMisfit(misfits);
  std::vector<std::vector<double>> own(planes), squares(planes);
  for (const PlaneMisfit& m : misfits) {
    own[m.plane].push_back(m.misfit);
    squares[m.plane].push_back(m.square);
  }
  const double most = std::max(1.0, kDisagrees * unit);
  for (std::size_t p = 0; p < planes; ++p) {
    if (own[p].size() < kMinOfPlane || typicalMisfit(std::move(own[p])) < most) continue;
    agree[p] = upperMedian(std::move(squares[p])) < kSurfaceSigma * kSurfaceSigma;
  }
  return agree;
}

}  // namespace vip_slam
