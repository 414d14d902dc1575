// SPDX-License-Identifier: BSD-3-Clause
// From the map to a bundle adjustment and back (paper sections "Local Plane and Point Bundle Adjustment" and "Global
// Plane and Point Bundle Adjustment"): which keyframes are free, which are fixed, and how the four variants turn
// landmarks and planes into factors.
#pragma once

#include <set>
#include <vector>

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/solver/ba_problem.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// What fixed keyframes and those outside both see of a plane is one block per plane (their poses are constants).
struct ProblemScope {
  std::vector<KeyframeId> free;   ///< optimised, ascending
  std::vector<KeyframeId> fixed;  ///< constant, ascending
};

/// Newest `window` keyframes, the IMU neighbour before them, and the observers of their landmarks (most shared first).
ProblemScope localScope(const Map& map, const LocalBaOptions& options);
/// All keyframes.
ProblemScope globalScope(const Map& map);

/// View of a landmark that contradicts the estimate: gated when the problem was built, or removed afterwards.
struct RefusedView {
  LandmarkId landmark = kNoLandmark;
  KeyframeId keyframe = 0;
  BaObservation observation;
};

struct BuiltProblem {
  BaProblem problem;
  std::vector<KeyframeId> frames;  ///< per problem frame; 0: the world frame of outside planes
  std::vector<LandmarkId> points;  ///< landmark of each point, one point per track, a landmark's longest track first
  std::vector<PlaneId> planes;
  std::vector<double> surface_variances;  ///< of the planes, m^2, when they were measured
  std::vector<LandmarkId> plane_points;   ///< landmarks that occur in homographies only (vip)
  std::vector<RefusedView> refused;       ///< gated views of those
  /// Landmark and keyframe of every observation, for outlier removal.
  std::vector<MapObservation> observations;
  DepthNoiseParts depth_noise;  ///< of the recording, learnt by the front end
  double gate_weight = 0;       ///< largest weight, focal / sigma, with which outliers are judged
};

struct BuilderSettings {
  Variant variant = Variant::kVip;
  MeasurementOptions measurement;
  bool shared_hosts = true;   ///< of homographies: few hosts for many landmarks, instead of first views
  bool middle_hosts = false;  ///< shared ones from the middle of the landmarks' tracks only
  /// How far landmarks lie beside their planes is measured with the poses as they are, which must fit each other, as in
  /// a local adjustment; else as the map knows it.
  bool measure_surfaces = false;
  double focal = 500;  ///< px
  DepthNoise depth_noise;
  Eigen::Vector3d gravity = gravityVector();
};

BuiltProblem buildProblem(const Map& map, const ProblemScope& scope, const BuilderSettings& settings);

/// Per plane of a problem, whether depth constrains it. Other planes have at most homographies and the prior of their
/// kind: the window saw them, but all their depth was gated.
std::vector<char> heldPlanes(const BaProblem& problem);

/// Writes the optimised variables back to the map. Landmarks that were no variables follow: plane points are
/// intersected with their plane, single views move with their keyframe. Keyframes that were removed meanwhile are
/// skipped.
void storeProblem(const BuiltProblem& built, const ImuNoise& noise, Map* map);

/// Removes observations with a residual above `chi2` (squared sigmas, each at least the gate's) or behind the camera;
/// returns them. To be called after storeProblem(): the refused views of landmarks on planes are judged by the
/// position stored there.
std::vector<RefusedView> removeOutliers(const BuiltProblem& built, double chi2, Map* map);

/// Those of `outliers`, found in an earlier problem with the same frames, that are still outliers after `built` was
/// solved and stored in `map`; those whose landmark is gone are.
std::vector<RefusedView> stillOutliers(const BuiltProblem& built, const std::vector<RefusedView>& outliers, double chi2,
                                       const Map& map);

}  // namespace vip_slam
