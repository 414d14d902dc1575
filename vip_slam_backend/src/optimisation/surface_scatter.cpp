// SPDX-License-Identifier: BSD-3-Clause
#include "surface_scatter.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_backend/factors/reprojection.h"
#include "vip_slam_core/util/significance.h"

namespace vip_slam::backend {
namespace {

// Points that the prior of a surface's scatter is worth.
constexpr double kPriorPoints = 4.0;
// Landmarks further from a plane, m, are not associated with it.
constexpr double kLargestScatter = 0.1;

OffPlane offPlane(const LandmarkView* begin, const LandmarkView* end, const LandmarkView& host, const Plane& plane,
                  const std::vector<FrameGeometry>& geometry) {
  const FrameGeometry& g = geometry[host.frame];
  const Eigen::Vector3d ray = g.R_C_W.transpose() * host.xy.cast<double>().homogeneous();
  const double incidence = plane.n.dot(ray);
  const Eigen::Vector3d point = g.t_W_C - (plane.signedDistance(g.t_W_C) / incidence) * ray;
  double information = 0, weighted = 0;
  for (const LandmarkView* v = begin; v != end; ++v) {
    if (!v->own_track || v->slides || v->frame == host.frame) continue;
    const FrameGeometry& o = geometry[v->frame];
    const Eigen::Vector3d p_C = o.R_C_W * (point - o.t_W_C), along = o.R_C_W * ray / incidence;
    if (p_C.z() < kMinProjectionDepth) continue;
    const Eigen::Vector2d expected = p_C.hnormalized();
    // By how much the view moves with the landmark's distance off the plane.
    const Eigen::Vector2d parallax = (along.head<2>() - along.z() * expected) / p_C.z();
    const double weight = 1 / (v->sigma * v->sigma + host.sigma * host.sigma);
    information += weight * parallax.squaredNorm();
    weighted += weight * parallax.dot(v->xy.cast<double>() - expected);
  }
  if (!(information > 0)) return {};
  return {weighted / information, 1 / information};
}

}  // namespace

std::vector<OffPlane> distancesOffPlane(const LandmarkViews& views, const std::vector<int>& plane,
                                        const std::vector<int>& hosts, const std::vector<BaPlane>& planes,
                                        const std::vector<FrameGeometry>& geometry) {
  std::vector<OffPlane> points(plane.size());
  for (int l = 0; l < views.size(); ++l)
    if (plane[l] >= 0 && hosts[l] >= 0)
      points[l] = offPlane(views.begin(l), views.end(l), views.begin(l)[hosts[l]], planes[plane[l]].plane, geometry);
  return points;
}

double surfaceVariance(const std::vector<OffPlane>& points, double prior) {
  // The slope of the posterior falls through zero at a maximum: an inverse gamma distribution with its mode at the
  // prior, times normal likelihoods of the distances. It is positive below the prior.
  const auto slope = [&points, prior](double variance) {
    double sum = kPriorPoints * (prior / variance - 1) / variance;
    for (const OffPlane& p : points) {
      const double all = p.variance + variance;
      sum += (std::min(p.distance * p.distance / all, kNoiseSigmas * kNoiseSigmas) - 1) / all;
    }
    return sum;
  };
  // The largest one, where a surface differs much from its prior.
  double low = kLargestScatter * kLargestScatter;
  while (slope(low) < 0) low *= 0.5;
  double high = 2 * low;
  while (high > 1.01 * low) {
    const double middle = std::sqrt(low * high);
    (slope(middle) > 0 ? low : high) = middle;
  }
  return low;
}

std::vector<double> surfaceVariances(const std::vector<OffPlane>& points, const std::vector<int>& plane,
                                     std::size_t planes, double sigma) {
  std::vector<OffPlane> known;
  std::vector<std::vector<OffPlane>> of_plane(planes);
  for (std::size_t l = 0; l < points.size(); ++l) {
    if (!std::isfinite(points[l].variance)) continue;
    known.push_back(points[l]);
    of_plane[plane[l]].push_back(points[l]);
  }
  const double all = surfaceVariance(known, sigma * sigma);
  std::vector<double> variances;
  for (const std::vector<OffPlane>& own : of_plane) variances.push_back(surfaceVariance(own, all));
  return variances;
}

bool liesOnPlane(const OffPlane& point, double surface_variance) {
  return kNoiseSigmas * kNoiseSigmas * surface_variance < point.variance;
}

}  // namespace vip_slam::backend
