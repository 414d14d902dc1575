#include "vip_slam_backend/optimisation/global_ba.h"

#include <set>

namespace vip_slam {

GlobalBaSolution solveGlobalBa(const GlobalBaProblem& job) {
  GlobalBaSolution solution;
  Map map = *job.map;
  const auto solver = makeSolver(job.solver);
  SolverOptions options;
  options.max_iterations = job.options.max_iterations;
  options.max_seconds = 0.5 * job.max_seconds;
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds; ++round) {
    solution.built = buildProblem(map, globalScope(map), job.settings);
    solution.summary = solver->solve(solution.built.problem, options);
    ++solution.rounds;
    if (round + 1 < kRounds) {
      storeProblem(solution.built, job.noise, &map);
      removeOutliers(solution.built, job.settings.measurement.outlier_chi2, &map);
    }
  }
  return solution;
}

void mergeGlobalBa(const GlobalBaSolution& solution, const ImuNoise& noise, Map* map) {
  std::set<KeyframeId> solved(solution.built.frames.begin(), solution.built.frames.end());
  KeyframeId newest = 0;
  for (const KeyframeId id : solved)
    if (map->hasKeyframe(id)) newest = std::max(newest, id);
  if (newest == 0) return;
  SE3 motion;  // of the newest solved keyframe, new from old world
  for (std::size_t f = 0; f < solution.built.frames.size(); ++f)
    if (solution.built.frames[f] == newest)
      motion = solution.built.problem.frames[f].T_W_C() * map->keyframe(newest).T_W_C().inverse();
  std::map<KeyframeId, SE3> moved;
  for (const auto& entry : map->keyframes())
    if (!solved.count(entry.first)) moved[entry.first] = motion * entry.second.state.T_W_I;
  map->moveKeyframes(moved);
  std::set<PlaneId> seen, seen_by_solved;
  for (const auto& entry : map->keyframes())
    for (const auto& plane : entry.second.planes)
      (moved.count(entry.first) ? seen : seen_by_solved).insert(plane.first);
  for (const PlaneId id : seen)
    if (!seen_by_solved.count(id)) map->movePlane(id, motion);
  storeProblem(solution.built, noise, map);
}

}  // namespace vip_slam
