// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/optimisation/global_ba.h"

#include <algorithm>
#include <set>

namespace vip_slam {

GlobalBaSolution solveGlobalBa(const GlobalBaProblem& job) {
  GlobalBaSolution solution;
  Map map = *job.map;
  const auto solver = makeSolver(job.solver);
  SolverOptions options;
  // Robust weights converge by a constant factor: twice the iterations would gain 1e-5 of the cost and no accuracy.
  options.function_tolerance = 1e-5;
  constexpr int kRounds = 2;
  options.max_seconds = job.max_seconds / kRounds;
  int iterations = job.options.max_iterations;  // of all rounds
  for (int round = 0; round < kRounds; ++round) {
    options.max_iterations = std::max(1, iterations / (kRounds - round));
    solution.built = buildProblem(map, globalScope(map), job.settings);
    solution.summary = solver->attempt(solution.built.problem, options);
    if (!solution.summary.usable) return solution;
    iterations -= solution.summary.iterations;
    storeProblem(solution.built, job.noise, &map);
    const double chi2 = job.settings.measurement.outlier_chi2;
    // The first round may have ended before the minimum, where good views look wrong: the last one decides. Without any
    // step, for want of time, it tells nothing.
    if (round + 1 == kRounds)
      solution.outliers = stillOutliers(solution.built, solution.outliers, chi2, map);
    else if (solution.summary.iterations > 0)
      solution.outliers = removeOutliers(solution.built, chi2, &map);
  }
  return solution;
}

void mergeGlobalBa(const GlobalBaSolution& solution, const ImuNoise& noise, Map* map) {
  std::set<KeyframeId> solved(solution.built.frames.begin(), solution.built.frames.end());
  KeyframeId newest = 0;
  for (const KeyframeId id : solved)
    if (map->hasKeyframe(id)) newest = std::max(newest, id);
  if (newest == 0) return;
  std::map<KeyframeId, SE3> motion;  // new from old world
  for (std::size_t f = 0; f < solution.built.frames.size(); ++f) {
    const KeyframeId id = solution.built.frames[f];
    if (map->hasKeyframe(id))
      motion[id] = solution.built.problem.frames[f].T_W_C() * map->keyframe(id).T_W_C().inverse();
  }
  const SE3 last = motion.at(newest);
  std::map<KeyframeId, SE3> moved;
  std::map<PlaneId, KeyframeId> seen_by;  // the newest keyframe
  for (const auto& entry : map->keyframes()) {
    if (motion.emplace(entry.first, last).second) moved[entry.first] = last * entry.second.state.T_W_I;
    for (const auto& plane : entry.second.planes) seen_by[plane.first] = entry.first;
  }
  map->moveKeyframes(moved);
  // Planes that the solution does not constrain, such as new ones, move with the newest keyframe that sees them.
  const std::vector<char> held = heldPlanes(solution.built.problem);
  for (std::size_t p = 0; p < solution.built.planes.size(); ++p)
    if (held[p]) seen_by.erase(solution.built.planes[p]);
  for (const auto& plane : seen_by) map->movePlane(plane.first, motion.at(plane.second));
  storeProblem(solution.built, noise, map);
  for (const RefusedView& outlier : solution.outliers) {
    const LandmarkId id = map->resolve(outlier.landmark);
    if (map->hasLandmark(id)) map->removeObservation(id, outlier.keyframe);
  }
}

}  // namespace vip_slam
