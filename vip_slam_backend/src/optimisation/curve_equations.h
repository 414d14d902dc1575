// SPDX-License-Identifier: BSD-3-Clause
// Normal equations for a depth error that depends on the reading alone, from depth points on planes: a wall seen from
// near and from far has one place. Poses are fixed, planes are free.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "jackknife.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/util/significance.h"

namespace vip_slam {

using PlaneSet = std::map<PlaneId, const Plane*>;

/// Rounds of reweighting and relinearisation.
constexpr int kFitRounds = 4;
/// Prior sigma of what depth is off by, m and share.
constexpr double kDepthOffSigma = 0.02;

/// This session's newest keyframes (200 at most) with depth points on planes.
std::vector<const MapKeyframe*> newestKeyframesOnPlanes(const Map& map);
PlaneSet allPlanes(const Map& map);
/// Splits the planes into two sets with about equally many points.
std::pair<PlaneSet, PlaneSet> halves(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes);

/// Whether a quantity is learnt, and no noise, from its size and the sigma of all that it scatters by. False for NaN.
inline bool isLearnt(double size, double sigma) { return size > kNoiseSigmas * sigma; }

/// Number of entries of a curve over the camera's range, 12 m at most.
int curveEntries(const DepthNoise& noise);

/// Normal equations of a curve's entries (DepthCurve::kStep apart) after the planes' elimination.
struct CurveEquations {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;   ///< gradient at the value they were built at
  double scatter = 1;  ///< squared residual per point: sigmas allow for errors that all points of a keyframe share
};

/// Linearised at `value`, m, the correction of the readings. Points far off their plane have hardly any weight, planes
/// that fit much worse than usual little; points beyond DepthNoise::unbiasedRange() are not used.
CurveEquations curveEquations(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes,
                              const Eigen::VectorXd& value, const DepthNoise& noise);

}  // namespace vip_slam
