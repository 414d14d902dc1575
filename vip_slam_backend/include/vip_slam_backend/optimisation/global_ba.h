// Global bundle adjustment beside the running back end: a copy of the problem goes in, a solution comes out, and is
// merged with what the map has become meanwhile.
#pragma once

#include <memory>

#include "vip_slam_backend/optimisation/problem_builder.h"
#include "vip_slam_backend/solver/ba_solver.h"

namespace vip_slam {

struct GlobalBaProblem {
  std::shared_ptr<const Map> map;  ///< copy; keyframe data are shared
  BuilderSettings settings;
  GlobalBaOptions options;
  std::string solver;
  ImuNoise noise;
  double max_seconds = 0;  ///< 0: none
  double t = 0;            ///< stamp of the newest keyframe
};

struct GlobalBaSolution {
  BuiltProblem built;
  SolverSummary summary;  ///< of the last round
  int rounds = 0;
};

/// Solves in rounds: between them homographies are compressed anew at the better estimate (depth ratios, gates,
/// weights).
GlobalBaSolution solveGlobalBa(const GlobalBaProblem& job);

/// Writes the solution into `map`. Keyframes and landmarks that came meanwhile, and planes that only such keyframes
/// see, move rigidly with the newest keyframe of the solution; what was removed meanwhile stays removed.
void mergeGlobalBa(const GlobalBaSolution& solution, const ImuNoise& noise, Map* map);

}  // namespace vip_slam
