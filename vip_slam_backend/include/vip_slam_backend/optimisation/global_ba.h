// SPDX-License-Identifier: BSD-3-Clause
// Global bundle adjustment in parallel to the running back end (paper section "Global Plane and Point Bundle
// Adjustment"): it solves a copy of the problem, and the solution is merged with the map, which has changed meanwhile.
#pragma once

#include <memory>
#include <string>
#include <vector>

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
  std::vector<RefusedView> outliers;  ///< found between the rounds, left out of the last one, and outliers there
  SolverSummary summary;              ///< of the last round
};

/// Solves in rounds: between them homographies are compressed again at the better estimate (depth ratios, gates,
/// weights).
GlobalBaSolution solveGlobalBa(const GlobalBaProblem& job);

/// Writes the solution into `map` and removes its outliers. Keyframes and landmarks added meanwhile, and planes that
/// only such keyframes see, move rigidly with the newest keyframe of the solution; what was removed meanwhile stays
/// removed.
void mergeGlobalBa(const GlobalBaSolution& solution, const ImuNoise& noise, Map* map);

}  // namespace vip_slam
