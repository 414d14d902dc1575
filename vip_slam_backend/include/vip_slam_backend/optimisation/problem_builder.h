// From the map to a bundle adjustment and back: which keyframes are free, which are held, and how the four variants
// turn landmarks and planes into factors.
#pragma once

#include <set>
#include <vector>

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/solver/ba_problem.h"

namespace vip_slam {

struct ProblemScope {
  std::vector<KeyframeId> free;   ///< optimised, ascending
  std::vector<KeyframeId> fixed;  ///< held, ascending
  /// Keyframes outside both hold the planes through one block per plane (their poses are constants).
  bool outside_planes = true;
};

/// Newest `window` keyframes, the IMU neighbour before them, and the observers of their landmarks (most shared first).
ProblemScope localScope(const Map& map, const LocalBaOptions& options);
/// All keyframes.
ProblemScope globalScope(const Map& map);

/// View of a landmark on a plane that the plane contradicted when the problem was built.
struct RefusedView {
  LandmarkId landmark = kNoLandmark;
  KeyframeId keyframe = 0;
  BaObservation observation;
};

struct BuiltProblem {
  BaProblem problem;
  std::vector<KeyframeId> frames;  ///< per problem frame; 0: the world frame of outside planes
  std::vector<LandmarkId> points;  ///< one per track: a landmark's first is its longest
  std::vector<PlaneId> planes;
  std::vector<LandmarkId> plane_points;  ///< landmarks that stand for homographies only (vip)
  std::vector<RefusedView> refused;      ///< of those
  /// Landmark and keyframe of every observation, for outlier removal.
  std::vector<MapObservation> observations;
  double track_noise_factor = 1;  ///< on the sigmas of all pixels, as the map tells (src/optimisation/track_noise.h)
  double gate_weight = 0;         ///< largest weight by which an observation is judged
};

struct BuilderSettings {
  Variant variant = Variant::kVip;
  MeasurementOptions measurement;
  bool shared_hosts = true;   ///< of homographies: few hosts for many landmarks, instead of first views
  bool middle_hosts = false;  ///< shared ones from the middle of the landmarks' tracks only
  double focal = 500;         ///< px
  Eigen::Vector3d gravity = gravityVector();
};

BuiltProblem buildProblem(const Map& map, const ProblemScope& scope, const BuilderSettings& settings);

/// Per plane of a problem, whether some factor holds it. Others have only the prior of their kind, or nothing: where a
/// window saw them but none of its depth was believed.
std::vector<char> heldPlanes(const BaProblem& problem);

/// Writes the optimised variables back. Landmarks that are no variables follow: plane points are intersected with their
/// plane, single views move with their keyframe. Keyframes that are gone meanwhile are skipped.
void storeProblem(const BuiltProblem& built, const ImuNoise& noise, Map* map);

/// Observations whose residual is above `chi2` (squared sigmas, at least `gate_sigma` each) or behind the camera are
/// removed from the map; their number. To be called after storeProblem(): of landmarks on planes those that were
/// refused are judged by the position stored.
int removeOutliers(const BuiltProblem& built, double chi2, Map* map);

}  // namespace vip_slam
