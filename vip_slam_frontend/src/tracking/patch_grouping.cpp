// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/patch_grouping.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

namespace {

constexpr int kMinPatches = 6;
constexpr int kRefinements = 3;
// Unevenness of a wall, m, and error of a patch's normal close to an edge, rad; one sigma each.
constexpr double kUneven = 0.003;
constexpr double kTurned = 0.03;
// Common error of the normals of all patches of a plane (warped depth), one sigma, rad.
constexpr double kTurnedTogether = 0.005;

/// N^T x = 1, in the camera frame.
struct PlaneFit {
  Eigen::Vector3d N = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal() const { return -N.normalized(); }  ///< towards the camera

  double distance(const Eigen::Vector3d& p_C) const { return (N.dot(p_C) - 1.0) / N.norm(); }

  bool holds(const SurfacePatch& patch) const {
    const double turned = normal().cross(patch.n_C).norm();
    return std::abs(distance(patch.p_C)) < kReadingSigmas * std::hypot(patch.sigma, kUneven) &&
           normal().dot(patch.n_C) > 0 && turned < kReadingSigmas * std::hypot(patch.sigma_normal, kTurned);
  }
};

/// Least squares over the distances of the patches with `member`; false when they do not span a plane.
bool fitPlane(const std::vector<SurfacePatch>& patches, const std::vector<char>& member, PlaneFit* plane) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!member[i]) continue;
    const double w = patches[i].n_C.dot(patches[i].p_C) / std::hypot(patches[i].sigma, kUneven);
    A += w * w * patches[i].p_C * patches[i].p_C.transpose();
    b += w * w * patches[i].p_C;
  }
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(A);
  if (!(ldlt.vectorD().minCoeff() > 1e-9 * ldlt.vectorD().maxCoeff())) return false;
  plane->N = ldlt.solve(b);
  return plane->N.allFinite() && plane->N.norm() > 1e-6;
}

/// Whether the plane spans a step between a wall and another one set back: it is close to stripes of both, and no
/// single patch's normal is exact enough to contradict it, but the mean of all normals is.
bool leansAcrossAStep(const std::vector<SurfacePatch>& patches, const std::vector<char>& member,
                      const PlaneFit& plane) {
  const Eigen::Vector3d n = plane.normal();
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();
  double weight = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!member[i]) continue;
    const double w = 1.0 / (patches[i].sigma_normal * patches[i].sigma_normal + kTurned * kTurned);
    turned += w * n.cross(patches[i].n_C);
    weight += w;
  }
  return turned.norm() / weight > kReadingSigmas * std::hypot(1.0 / std::sqrt(weight), kTurnedTogether);
}

/// The plane round patch `seed` and its members among those that are not `done`; false when there is none.
/// `extrapolate`: starts with all patches at any distance that the seed's normal and its sigma allow, else with those
/// close to the seed's plane.
bool growPlane(const std::vector<SurfacePatch>& patches, const std::vector<char>& done, std::size_t seed,
               bool extrapolate, std::vector<char>* member, PlaneFit* plane) {
  const SurfacePatch& from = patches[seed];
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const Eigen::Vector3d step = patches[i].p_C - from.p_C;
    const double away = extrapolate ? from.sigma_normal * step.norm() : kUneven;
    const double sigma = std::hypot(std::hypot(from.sigma, patches[i].sigma), away);
    (*member)[i] =
        !done[i] && std::abs(from.n_C.dot(step)) < kReadingSigmas * sigma && from.n_C.dot(patches[i].n_C) > 0.9;
  }
  for (int k = 0; k < kRefinements; ++k) {
    if (!fitPlane(patches, *member, plane)) return false;
    int count = 0;
    for (std::size_t i = 0; i < patches.size(); ++i) count += (*member)[i] = !done[i] && plane->holds(patches[i]);
    if (count < kMinPatches) return false;
  }
  return fitPlane(patches, *member, plane) && !leansAcrossAStep(patches, *member, *plane);
}

}  // namespace

std::vector<SurfacePatch> shareNormals(std::vector<SurfacePatch> patches) {
  std::vector<SurfacePatch> result;
  std::vector<char> done(patches.size(), 0), member(patches.size());
  int surfaces = 0;
  for (std::size_t seed = 0; seed < patches.size(); ++seed) {
    if (done[seed]) continue;
    PlaneFit plane;
    if (!growPlane(patches, done, seed, true, &member, &plane) &&
        !growPlane(patches, done, seed, false, &member, &plane)) {
      continue;
    }
    for (std::size_t i = 0; i < patches.size(); ++i) {
      if (!member[i]) continue;
      done[i] = 1;
      result.push_back(patches[i]);
      result.back().n_C = plane.normal();
      result.back().surface = surfaces;
      result.back().deviation = plane.distance(patches[i].p_C);
    }
    ++surfaces;
  }
  return result;
}

}  // namespace vip_slam
