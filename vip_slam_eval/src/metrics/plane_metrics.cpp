// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/metrics/plane_metrics.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_eval/metrics/polygon_overlap.h"

namespace vip_slam {
namespace {

struct Outline {
  double mean_distance = 0;  ///< metres, mean along the outline to the true plane
  bool empty = true;
};

Outline outlineAgainst(const Plane& truth, const PlaneEstimate& estimate) {
  double sum = 0, length = 0;
  for (const PlanePolygon& polygon : estimate.polygons) {
    const Ring& ring = polygon.outer;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      // Weighted by length, so that densely sampled corners do not count more.
      const Eigen::Vector3d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      const double weight = (b - a).norm();
      sum += weight * 0.5 * (std::abs(truth.signedDistance(a)) + std::abs(truth.signedDistance(b)));
      length += weight;
    }
  }
  return {length > 0 ? sum / length : 0.0, length <= 0};
}

// Area-weighted centroid of the outlines, on the estimated plane.
Eigen::Vector3d middleOf(const PlaneEstimate& plane) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double total = 0;
  for (const PlanePolygon& polygon : plane.polygons) {
    const Ring& ring = polygon.outer;
    for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
      const double area = 0.5 * plane.plane.n.dot((ring[i] - ring[0]).cross(ring[i + 1] - ring[0]));
      sum += area * (ring[0] + ring[i] + ring[i + 1]) / 3.0;
      total += area;
    }
  }
  if (std::abs(total) < 1e-9) return plane.plane.project(plane.polygons.front().outer.front());
  return plane.plane.project(sum / total);
}

struct Candidate {
  std::size_t truth;
  double overlap, score, angle;
};

}  // namespace

std::vector<PlaneEstimate> transformPlanes(const SE3& T_A_B, std::vector<PlaneEstimate> planes) {
  for (PlaneEstimate& plane : planes) {
    plane.plane = transformPlane(T_A_B, plane.plane);
    for (PlanePolygon& polygon : plane.polygons) {
      for (Eigen::Vector3d& p : polygon.outer) p = T_A_B * p;
      for (Ring& hole : polygon.holes) {
        for (Eigen::Vector3d& p : hole) p = T_A_B * p;
      }
    }
  }
  return planes;
}

PlaneMetrics planeMetrics(const std::vector<TruePlane>& truth, const std::vector<PlaneEstimate>& estimate,
                          const PlaneMatchOptions& options) {
  PlaneMetrics result;
  std::vector<FlatRegion> regions;
  std::vector<double> areas;
  for (const TruePlane& plane : truth) {
    regions.emplace_back(plane.polygons, plane.plane);
    areas.push_back(regions.back().area());
    TruePlaneResult row;
    row.id = plane.id;
    row.visible_area = plane.seen_area >= 0 ? plane.seen_area : areas.back();
    // The system ignores slanted surfaces by design, so they do not count for recall; estimating one is no error
    // either.
    row.counts = plane.kind != PlaneKind::kGeneral && row.visible_area >= options.min_area &&
                 (plane.seen_seconds < 0 || plane.seen_seconds >= options.min_seconds);
    result.truths.push_back(row);
  }

  std::vector<double> normal_errors, distance_errors;
  result.estimated = estimate.size();
  for (const PlaneEstimate& plane : estimate) {
    PlaneMatch match;
    match.estimate = plane.id;
    match.area = FlatRegion(plane.polygons, plane.plane).area();
    std::vector<Candidate> candidates;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const Plane& true_plane = truth[k].plane;
      if (plane.plane.n.dot(true_plane.n) < std::cos(options.max_angle)) continue;
      const Outline outline = outlineAgainst(true_plane, plane);
      if (outline.empty || outline.mean_distance > options.max_distance) continue;
      const double overlap = FlatRegion::overlap(FlatRegion(plane.polygons, true_plane), regions[k]);
      if (overlap <= 0 || overlap < options.min_overlap * std::min(match.area, areas[k])) continue;
      candidates.push_back({k, overlap, overlap * (1.0 - 0.9 * outline.mean_distance / options.max_distance),
                            angleBetween(plane.plane, true_plane)});
    }
    for (const Candidate& candidate : candidates) {
      result.truths[candidate.truth].found = true;
      result.truths[candidate.truth].covered_area += candidate.overlap;
    }
    const auto best = std::max_element(candidates.begin(), candidates.end(),
                                       [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
    if (best == candidates.end()) {
      ++result.false_planes;
      if (match.area > options.false_area) ++result.large_false_planes;
    } else {
      TruePlaneResult& row = result.truths[best->truth];
      ++row.represented_by;
      match.truth = row.id;
      const bool slanted = truth[best->truth].kind == PlaneKind::kGeneral;
      if (slanted && plane.kind != PlaneKind::kGeneral) ++result.forced_planes;
      match.overlap = best->overlap;
      match.normal_error = best->angle;
      match.distance_error = std::abs(truth[best->truth].plane.signedDistance(middleOf(plane)));
      normal_errors.push_back(match.normal_error / kDegree);
      distance_errors.push_back(match.distance_error);
    }
    result.matches.push_back(match);
  }

  for (const TruePlaneResult& row : result.truths) {
    if (row.represented_by > 1) result.duplicates += row.represented_by - 1;
    if (!row.counts) continue;
    ++result.expected;
    if (row.found) ++result.found;
  }
  result.recall = result.expected == 0 ? 1.0 : double(result.found) / double(result.expected);
  result.normal = summarise(std::move(normal_errors));
  result.distance = summarise(std::move(distance_errors));
  return result;
}

}  // namespace vip_slam
