// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/association/plane_sampler.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/significance.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_planes/detection/plane_fit.h"

namespace vip_slam {

std::vector<std::vector<Eigen::Vector3d>> pointsByLabel(const Keyframe& keyframe, const SurfaceLabels& labels,
                                                        const std::vector<Eigen::Vector2f>& rays, std::size_t count) {
  const DepthGrid& grid = keyframe.frame.depth_grid;
  std::vector<std::vector<Eigen::Vector3d>> points(count);
  for (int r = 1; r + 1 < grid.rows; ++r) {
    for (int c = 1; c + 1 < grid.cols; ++c) {
      const int label = grid.at(c, r) > 0 ? labels.inner(c, r) : -1;
      if (label < 0) continue;
      const Eigen::Vector2f& ray = rays[std::size_t(r) * grid.cols + c];
      points[label].push_back(Eigen::Vector3d(ray.x(), ray.y(), 1.0) * grid.at(c, r));
    }
  }
  for (const Feature& f : keyframe.frame.features) {
    const int label = f.depth > 0 ? labels.around(f.pixel) : -1;
    if (label >= 0) points[label].push_back(Eigen::Vector3d(f.xy.x(), f.xy.y(), 1.0) * f.depth);
  }
  return points;
}

double PlaneSampler::sigmaAlong(const Eigen::Vector3d& n_C, const Eigen::Vector3d& p_C) const {
  return noise_.sigma(p_C.z()) * std::abs(n_C.dot(p_C)) / p_C.z();
}

std::vector<Eigen::Vector3d> PlaneSampler::spreadEvenly(const std::vector<Eigen::Vector3d>& points,
                                                        const Eigen::Vector3d& n) const {
  // One sample per voxel of the plane: the mean of its points. Coarser voxels when there would be too many.
  const Eigen::Matrix<double, 3, 2> basis = tangentBasis(n);
  std::vector<Eigen::Vector2d> at;
  at.reserve(points.size());
  for (const Eigen::Vector3d& p : points) at.push_back(basis.transpose() * p);
  std::map<std::pair<std::int64_t, std::int64_t>, std::size_t> index;  // of each voxel's sum
  double voxel = options_.voxel;
  std::vector<std::pair<Eigen::Vector3d, int>> sums;
  while (true) {
    index.clear();
    sums.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector2d q = (at[i] / voxel).array().floor();
      const auto key = std::make_pair(static_cast<std::int64_t>(q.y()), static_cast<std::int64_t>(q.x()));
      const auto [sum, fresh] = index.try_emplace(key, sums.size());
      if (fresh) sums.emplace_back(Eigen::Vector3d::Zero(), 0);
      sums[sum->second].first += points[i];
      ++sums[sum->second].second;
    }
    if (sums.size() > std::size_t(options_.max_points)) {
      voxel *= 1.02 * std::sqrt(double(sums.size()) / options_.max_points);
      continue;
    }
    std::vector<Eigen::Vector3d> means;
    for (const auto& [sum, count] : sums) means.push_back(sum / count);
    return means;
  }
}

bool PlaneSampler::keepLocalSurface(const Eigen::Vector3d& n_C, std::vector<Eigen::Vector3d>* points) const {
  std::vector<double> weights;
  std::vector<double> sigmas;
  for (const Eigen::Vector3d& p : *points) {
    sigmas.push_back(sigmaAlong(n_C, p) + 0.001);
    weights.push_back(1.0 / (sigmas.back() * sigmas.back()));
  }
  Plane local;
  const double median = upperMedian(sigmas);
  if (!fitPlaneRobust(*points, weights, median, PlaneKind::kGeneral, n_C, &local, nullptr)) return false;
  std::vector<Eigen::Vector3d> kept;
  PlaneMoments moments;
  for (std::size_t i = 0; i < points->size(); ++i) {
    if (std::abs(local.signedDistance((*points)[i])) > options_.inlier_sigmas * sigmas[i]) continue;
    kept.push_back((*points)[i]);
    moments.add((*points)[i], 1.0);
  }
  // Mostly outliers: clutter. Rotated by more than noise explains for a surface of this size: another surface.
  if (kept.size() < std::max<std::size_t>(options_.min_points, points->size() / 2)) return false;
  const double slack =
      kNoiseSigmas * (median + 0.3 * noise_.bias_floor) / moments.spread() / std::sqrt(double(kept.size()) / 9.0);
  const double turned = std::acos(std::min(1.0, std::abs(local.n.dot(n_C))));
  *points = std::move(kept);
  return turned < 5.0 * kDegree + slack;
}

void PlaneSampler::accumulate(const Eigen::Vector3d& n_C, PlaneObservation* observation) const {
  PlaneMoments moments;
  for (PlaneSample& point : observation->points) {
    const Eigen::Vector3d p = point.p_C.cast<double>();
    const double sigma = std::hypot(sigmaAlong(n_C, p), noise_.bias_floor);
    point.sigma = float(sigma);
    moments.add(p, 1.0 / (double(point.sigma) * double(point.sigma)));
  }
  const Eigen::Vector3d centre = moments.centroid();
  const double shared = noise_.shared(centre.z()) * std::abs(n_C.dot(centre)) / centre.z();
  observation->weight_scale = 1 / (1 + moments.weight() * shared * shared);
  observation->G = observation->weight_scale * moments.M;
}

std::optional<PlaneObservation> PlaneSampler::sample(KeyframeId keyframe, const std::vector<Eigen::Vector3d>& shown,
                                                     const SE3& T_map_C, PlaneId plane_id, const Plane& plane) const {
  const Plane plane_C = transformPlane(T_map_C.inverse(), plane);
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& p : shown) {
    const double gate = std::max(distance_gate_, kNoiseSigmas * sigmaAlong(plane_C.n, p));
    if (std::abs(plane_C.signedDistance(p)) < gate) points.push_back(p);
  }
  if (points.size() < std::size_t(options_.min_points)) return {};
  points = spreadEvenly(points, plane_C.n);
  if (points.size() < std::size_t(options_.min_points) || !keepLocalSurface(plane_C.n, &points)) return {};

  PlaneObservation observation;
  observation.keyframe = keyframe;
  observation.plane = plane_id;
  for (const Eigen::Vector3d& p : points) observation.points.push_back({p.cast<float>(), 0.0f});
  accumulate(plane_C.n, &observation);
  return observation;
}

}  // namespace vip_slam
