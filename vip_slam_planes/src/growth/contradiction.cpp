// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/growth/contradiction.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/significance.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_planes/detection/plane_fit.h"
#include "vip_slam_planes/growth/triangle_association.h"

namespace vip_slam {
namespace {

constexpr double kFacing = 0.7;    // cosine to the plane's normal; sides of objects on it are turned further
constexpr double kOnPlane = 0.01;  // m, plus three sigmas: largest distance of a corner that lies on a plane

/// The nearest plane on whose covered area a corner lies; null: none.
const PlaneTrack* ownerOf(const Eigen::Vector3d& corner, double sigma, const std::vector<const PlaneTrack*>& tracks) {
  const PlaneTrack* owner = nullptr;
  double best = kOnPlane + kNoiseSigmas * sigma;
  for (const PlaneTrack* track : tracks) {
    const double distance = std::abs(track->plane().signedDistance(corner));
    if (distance < best && track->cells().near(track->cellAt(track->toPlane(corner)), 1)) {
      best = distance;
      owner = track;
    }
  }
  return owner;
}

/// Whether a triangle spans two planes, and so lies on neither. A narrow shelf seen at a flat angle may have only such
/// triangles: from its front edge over its single row of points to the wall behind they form a smooth ramp.
bool spansPlanes(const MapTriangle& t, const std::vector<const PlaneTrack*>& tracks) {
  const PlaneTrack* first = nullptr;
  for (const Eigen::Vector3d& corner : t.corner) {
    const PlaneTrack* owner = ownerOf(corner, t.sigma, tracks);
    if (owner && first && owner != first) return true;
    if (owner) first = owner;
  }
  return false;
}

}  // namespace

PlaneVerdict planeVerdict(const std::vector<MapTriangle>& triangles, const PlaneTrack& track,
                          const std::vector<const PlaneTrack*>& all, const PlaneDetectionOptions& detection,
                          const PlaneGrowthOptions& growth) {
  std::vector<Eigen::Vector3d> points;
  std::vector<double> weights, sigmas;
  double area = 0;
  for (const MapTriangle& t : triangles) {
    if (std::abs(track.plane().signedDistance(t.centre)) > distanceGate(t, growth.distance)) continue;
    if (track.plane().n.dot(t.n) < kFacing || !track.cells().at(track.cellAt(track.toPlane(t.centre)))) continue;
    if (spansPlanes(t, all)) continue;
    points.push_back(t.centre - triangles.front().centre);
    weights.push_back(fitWeight(t));
    sigmas.push_back(t.sigma);
    area += t.area;
  }
  // A smaller part of a wall may bend.
  if (points.empty() || 2 * area < track.area()) return PlaneVerdict::kNone;
  const double sigma = upperMedian(std::move(sigmas));
  Plane shown;
  double rms = 0;
  if (!fitPlaneRobust(points, weights, sigma + 0.002, PlaneKind::kGeneral, track.plane().n, &shown, &rms)) {
    return PlaneVerdict::kNone;
  }
  PlaneMoments moments;
  for (const Eigen::Vector3d& p : points) moments.add(p, 1.0);
  // Neighbouring triangles share vertices: count a quarter of them as independent.
  const double uncertainty = std::max(sigma, rms) / (moments.spread() * std::sqrt(double(points.size()) / 4.0));
  const double turned = std::acos(std::min(1.0, shown.n.dot(track.plane().n)));
  const bool against = turned > detection.max_tilt_deg * kDegree + kNoiseSigmas * uncertainty;
  return against ? PlaneVerdict::kAgainst : PlaneVerdict::kFor;
}

}  // namespace vip_slam
