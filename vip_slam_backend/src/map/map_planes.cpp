// SPDX-License-Identifier: BSD-3-Clause
// Planes of the map: estimates, observations by keyframes, association of landmarks.
#include <cmath>

#include "map_validation.h"
#include "vip_slam_backend/factors/point_to_plane.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map/map_limits.h"
#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam {
namespace {

/// Empty when the parameters are those of a plane, else what is wrong with them.
std::string validateParameters(const Plane& plane) {
  if (!plane.n.allFinite() || !std::isfinite(plane.d)) return "parameters are not finite";
  const double length = plane.n.norm();
  if (std::abs(length - 1.0) > 1e-3) return "normal of length " + std::to_string(length) + ", expected 1";
  return "";
}

/// Its normal within the tolerance of files and checks, the same bits when it was already.
Plane withUnitNormal(const Plane& plane) {
  return std::abs(plane.n.norm() - 1.0) > map_limits::kRounding ? Plane(plane.n, plane.d) : plane;
}

}  // namespace

void Map::setPlane(const PlaneEstimate& estimate) {
  const std::string name = "plane " + std::to_string(estimate.id);
  if (estimate.id == 0) throw MapError("a plane needs an id");
  const std::string bad = validateParameters(estimate.plane);
  if (!bad.empty()) throw MapError(name + ": " + bad);
  const int kind = static_cast<int>(estimate.kind);
  if (kind < 0 || kind > static_cast<int>(PlaneKind::kGeneral))
    throw MapError(name + ": kind " + std::to_string(kind) + ", expected 0 (horizontal), 1 (vertical) or 2 (general)");
  if (!isAreaFinite(estimate)) throw MapError(name + ": its area or outline is not finite");
  MapPlane& plane = planes_[estimate.id];
  const Plane optimised = plane.estimate.plane;
  plane.estimate = estimate;
  plane.estimate.plane = plane.optimised ? optimised : withUnitNormal(estimate.plane);
}

void Map::setPlaneParameters(PlaneId id, const Plane& parameters) {
  const auto it = planes_.find(id);
  if (it == planes_.end()) throw MapError("no plane " + std::to_string(id) + " in the map");
  const std::string bad = validateParameters(parameters);
  if (!bad.empty()) throw MapError("plane " + std::to_string(id) + ": new " + bad);
  it->second.estimate.plane = withUnitNormal(parameters);
  it->second.optimised = true;
}

void Map::setSurfaceVariance(PlaneId id, double variance) {
  const auto it = planes_.find(id);
  if (it == planes_.end()) throw MapError("no plane " + std::to_string(id) + " in the map");
  if (!(variance > 0) || !std::isfinite(variance))
    throw MapError("plane " + std::to_string(id) + ": the variance of its surface is not positive and finite");
  it->second.surface_variance = variance;
}

void Map::movePlane(PlaneId id, const SE3& motion) {
  const auto it = planes_.find(id);
  if (it == planes_.end()) throw MapError("no plane " + std::to_string(id) + " in the map");
  if (!motion.isFinite()) throw MapError("plane " + std::to_string(id) + ": its motion is not finite");
  it->second.estimate.plane = transformPlane(motion, it->second.estimate.plane);
}

void Map::mergePlanes(PlaneId from, PlaneId into) {
  if (from == into || !hasPlane(from)) return;
  if (into == 0) throw MapError("plane " + std::to_string(from) + ": merged into plane 0, which stands for none");
  if (!hasPlane(into)) {
    MapPlane plane = planes_[from];
    plane.estimate.id = into;
    planes_[into] = plane;
  }
  for (auto& entry : keyframes_) {
    auto& observations = entry.second.planes;
    const auto it = observations.find(from);
    if (it == observations.end()) continue;
    PlaneObservation moved = std::move(it->second);
    observations.erase(it);
    moved.plane = into;
    const auto other = observations.find(into);
    if (other == observations.end()) {
      observations.emplace(into, std::move(moved));
    } else {
      addPiece(moved, &other->second);
    }
  }
  for (auto& entry : landmarks_)
    if (entry.second.plane == from) entry.second.plane = into;
  planes_.erase(from);
}

void Map::removePlane(PlaneId id) {
  for (auto& entry : keyframes_) entry.second.planes.erase(id);
  for (auto& entry : landmarks_)
    if (entry.second.plane == id) entry.second.plane = 0;
  planes_.erase(id);
}

std::string validateObservation(const PlaneObservation& observation) {
  const std::string name = "plane " + std::to_string(observation.plane) + ", seen by keyframe " +
                           std::to_string(observation.keyframe) + ": ";
  if (!observation.G.allFinite()) return name + "moments are not finite";
  if (!isSumOfSquares(observation.G)) return name + "moments are no sum of squares";
  if (!(observation.weight_scale > 0) || !std::isfinite(observation.weight_scale))
    return name + "weight is " + std::to_string(observation.weight_scale);
  for (const PlaneSample& p : observation.points)
    if (!p.p_C.allFinite() || !(p.sigma > 0) || !std::isfinite(p.sigma)) return name + "a point is not finite";
  const std::string camera = validateCameraCorrection(observation.camera_correction);
  return camera.empty() ? "" : name + "the camera's correction: " + camera;
}

bool Map::setPlaneObservation(const PlaneObservation& observation) {
  if (!hasKeyframe(observation.keyframe) || !hasPlane(observation.plane)) return false;
  if (!validateObservation(observation).empty()) return false;
  MapKeyframe& kf = keyframe(observation.keyframe);
  // An observation without points would count as a perfect fit.
  if (observation.points.empty()) {
    kf.planes.erase(observation.plane);
    return true;
  }
  PlaneObservation& stored = kf.planes[observation.plane] = observation;
  // The plane module may not know the present correction of this keyframe's depth yet.
  setCameraCorrection(kf.data->frame.camera_correction, &stored);
  return true;
}

void Map::associate(LandmarkId id, PlaneId plane) {
  if (plane != 0 && !hasPlane(plane)) throw MapError("no plane " + std::to_string(plane) + " in the map");
  landmark(id).plane = plane;
}

}  // namespace vip_slam
