// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/metrics/association_metrics.h"

#include <cmath>
#include <map>

#include "vip_slam_eval/metrics/polygon_overlap.h"

namespace vip_slam {
namespace {

bool liesOn(const PlaneEstimate& plane, const FlatRegion& region, const Eigen::Vector3d& p, double tolerance) {
  if (std::abs(plane.plane.signedDistance(p)) > tolerance) return false;
  const Eigen::Vector2d at = planeCoordinates(plane.plane, p);
  for (const Eigen::Vector2d& shift :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(tolerance, 0), Eigen::Vector2d(-tolerance, 0),
        Eigen::Vector2d(0, tolerance), Eigen::Vector2d(0, -tolerance)}) {
    if (region.contains(at + shift)) return true;
  }
  return false;
}

}  // namespace

AssociationMetrics associationMetrics(const std::vector<LabelledPoint>& points, const std::vector<TruePlane>& truth,
                                      const PlaneMetrics& planes, int min_keyframes, double tolerance) {
  // One estimate may represent several coplanar true planes (tables of equal height): a point on any of them is
  // correct.
  std::map<PlaneId, Plane> represented;
  for (const PlaneMatch& match : planes.matches) {
    for (const PlaneEstimate& plane : truth) {
      if (match.truth == plane.id && match.truth != 0) represented[match.estimate] = plane.plane;
    }
  }
  std::vector<FlatRegion> regions;
  for (const PlaneEstimate& plane : truth) regions.emplace_back(plane.polygons, plane.plane);

  AssociationMetrics result;
  for (const LabelledPoint& point : points) {
    bool correct = false, on_found = false;
    const auto label = represented.find(point.plane);
    for (std::size_t k = 0; k < truth.size(); ++k) {
      if (!liesOn(truth[k], regions[k], point.p_W, tolerance)) continue;
      const bool same = label != represented.end() && angleBetween(label->second, truth[k].plane) < 0.02 &&
                        std::abs(label->second.signedDistance(point.p_W)) <= tolerance;
      correct = correct || same;
      on_found = on_found || (k < planes.truths.size() && planes.truths[k].found);
    }
    if (point.plane != 0) {
      ++result.labelled;
      if (correct) ++result.correct;
    }
    if (on_found && point.keyframes >= min_keyframes) {
      ++result.on_found_planes;
      if (correct) ++result.recovered;
    }
  }
  if (result.labelled > 0) result.precision = double(result.correct) / double(result.labelled);
  if (result.on_found_planes > 0) result.recall = double(result.recovered) / double(result.on_found_planes);
  return result;
}

}  // namespace vip_slam
