// What the depth points on planes say about an error of the camera's that depends on the reading alone: a wall seen
// from near and from far has one place. Poses are held, planes are free.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

using PlaneSet = std::map<PlaneId, const Plane*>;

/// Fewer keyframes say nothing.
constexpr int kLeastCurveKeyframes = 15;

/// This session's newest keyframes (200 at most) with depth points on planes.
std::vector<const MapKeyframe*> newestKeyframesOnPlanes(const Map& map);
PlaneSet allPlanes(const Map& map);
/// Two sets with about as many points each.
std::pair<PlaneSet, PlaneSet> halves(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes);

/// Entries of a curve that reaches over the camera's range, 12 m at most.
int curveEntries(const DepthNoise& noise);

/// Normal equations of a curve's entries (DepthCurve::kStep apart) after the planes' elimination.
struct CurveEquations {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;   ///< gradient at the value they were built at
  double scatter = 1;  ///< squared residual per point: sigmas allow for errors that all points of a keyframe share
  /// What each keyframe has of g, in columns. All its points share the error of its pose, so that these scatter as
  /// errors do, however many points there are.
  Eigen::MatrixXd shares;
};

/// About `value`, m, what readings are added there. Points far off their plane count for nothing, planes that fit much
/// worse than usual for little; points of planes beyond the range that noise leaves whole for nothing as well.
CurveEquations curveEquations(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes,
                              const Eigen::VectorXd& value, const DepthNoise& noise);

}  // namespace vip_slam
