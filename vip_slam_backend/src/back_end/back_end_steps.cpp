// SPDX-License-Identifier: BSD-3-Clause
// The steps of the back end between a keyframe and a map update.
#include <algorithm>
#include <cmath>

#include "back_end_impl.h"
#include "vip_slam_backend/loop/graph_builder.h"
#include "vip_slam_backend/optimisation/inertial_scale.h"

namespace vip_slam {

void BackEnd::Impl::localBundleAdjustment(double t, MapUpdate* update) {
  const ScopedTimer timer(log, "backend.lba", t);
  BuiltProblem built;
  {
    const ScopedTimer build_timer(log, "backend.lba_build", t);
    BuilderSettings local = settings;
    local.shared_hosts = options.local_ba.shared_hosts;
    local.middle_hosts = options.local_ba.middle_hosts;
    local.measure_surfaces = true;
    built = buildProblem(map, localScope(map, options.local_ba), local);
  }
  SolverOptions solver_options;
  solver_options.max_iterations = options.local_ba.max_iterations;
  solver_options.max_seconds = options.lockstep ? 0 : options.local_ba.max_seconds;
  solver_options.function_tolerance = 1e-4;
  SolverSummary summary;
  {
    const ScopedTimer solve_timer(log, "backend.lba_solve", t);
    summary = solver->attempt(built.problem, solver_options);
    if (!summary.usable) return report.refusals.add("result of the local adjustment: " + summary.message);
  }
  storeProblem(built, sensor.imu_noise, &map);
  // Without any step, for want of time, good views may look wrong.
  if (summary.iterations > 0)
    report.statistics.outliers += removeOutliers(built, options.measurement.outlier_chi2, &map).size();
  odometry.follow(map);
  odometry_noise.compare(map, map.newestKeyframe());

  std::set<LandmarkId> landmarks;
  for (std::size_t f = 0; f < built.frames.size(); ++f) {
    if (built.problem.frames[f].fixed) continue;
    const MapKeyframe& kf = map.keyframe(built.frames[f]);
    update->keyframes.push_back(estimateOf(kf));
    for (const LandmarkId id : kf.landmarks)
      if (id != kNoLandmark) landmarks.insert(id);
  }
  for (const LandmarkId id : landmarks) update->landmarks.push_back(estimateOf(map.landmark(id)));
  for (const PlaneId id : built.planes)
    if (map.planes().at(id).optimised) update->planes.emplace_back(id, map.planes().at(id).estimate.plane);
}

void BackEnd::Impl::cull(MapUpdate* update) {
  if (!options.culling.enabled) return;
  if (map.keyframes().size() > static_cast<std::size_t>(std::max(3, options.culling.above_keyframes))) {
    auto it = map.keyframes().rbegin();
    std::advance(it, 2);
    cullLandmarks(it->first, &map);
  }
  const auto removed =
      cullKeyframes(options.culling, options.local_ba.window, sensor.imu_noise, loop_closer.loops(), &map);
  for (const KeyframeId id : removed) loop_closer.remove(id);
  update->landmarks.erase(std::remove_if(update->landmarks.begin(), update->landmarks.end(),
                                         [&](const LandmarkEstimate& l) { return !map.hasLandmark(l.id); }),
                          update->landmarks.end());
}

bool BackEnd::Impl::placed() const {
  if (map.empty() || localisation.searching) return false;
  if (localisation.last_found && localisation.last_found->epoch == odometry.epoch()) return true;
  return referencePart(map, loop_closer.loops()).count(map.newestKeyframe()) != 0;
}

MapUpdate BackEnd::Impl::beginUpdate(double t) const {
  MapUpdate update;
  update.t = t;
  return update;
}

KeyframeEstimate BackEnd::Impl::estimateOf(const MapKeyframe& kf) const {
  return {kf.id(), kf.state, kf.T_I_C, kf.data->frame.camera_correction};
}

LandmarkEstimate BackEnd::Impl::estimateOf(const MapLandmark& landmark) const {
  LandmarkEstimate out;
  out.id = landmark.id;
  out.p_W = landmark.p_W;
  out.observations = static_cast<std::uint32_t>(landmark.observations.size());
  out.plane = landmark.plane;
  out.descriptor = landmark.descriptor;
  return out;
}

void BackEnd::Impl::fillGlobal(MapUpdate* update) const {
  update->global = true;
  update->keyframes.clear();
  update->landmarks.clear();
  update->planes.clear();
  for (const auto& entry : map.keyframes()) update->keyframes.push_back(estimateOf(entry.second));
  for (const LandmarkId id : map.landmarkIds()) update->landmarks.push_back(estimateOf(map.landmark(id)));
  for (const auto& entry : map.planes()) update->planes.emplace_back(entry.first, entry.second.estimate.plane);
}

void BackEnd::Impl::finishUpdate(MapUpdate* update) {
  update->revision = numbers.nextRevision();
  update->epoch = odometry.epoch();
  update->T_map_odom = odometry.T_map_odom();
  update->placed = placed();
  update->parts = epochParts(map, loop_closer.loops());
  update->depth_curve = calibration.camera().curve;
  update->disparity_error = calibration.disparityError();
  update->odometry_variance = odometry_noise.varianceFactor();
  update->newest_keyframe = map.newestKeyframe();
  if (update->newest_keyframe != 0) update->t = map.keyframe(update->newest_keyframe).data->frame.t;
  MapChanges changes = map.takeChanges();
  update->removed_keyframes = std::move(changes.removed_keyframes);
  update->removed_landmarks = std::move(changes.removed_landmarks);
  update->merged_landmarks = std::move(changes.merged_landmarks);
  update->loops = report.loops.takeNew();
}

bool BackEnd::Impl::learnDepthCurve() {
  if (!options.depth_curve || frozen()) return false;
  const ScopedTimer timer(log, "backend.depth_curve", map.empty() ? 0 : map.keyframes().rbegin()->second.data->frame.t);
  if (!calibration.learnDepthCurve(sensor.depth_noise, options.disparity, &map)) return false;
  global.outdate();
  return true;
}

void BackEnd::Impl::askForScale() { report.statistics.scale = inertialScale(map, sensor.gravity, sensor.imu_noise); }

GbaJob BackEnd::Impl::makeGlobalJob() const {
  GbaJob job;
  job.correction = global.correction();
  if (map.keyframes().size() < 2) return job;
  auto problem = std::make_shared<GlobalBaProblem>();
  problem->map = std::make_shared<const Map>(map);
  problem->settings = settings;
  problem->settings.shared_hosts = options.global_ba.shared_hosts;
  problem->settings.middle_hosts = options.global_ba.middle_hosts;
  problem->options = options.global_ba;
  problem->solver = options.solver;
  problem->noise = sensor.imu_noise;
  problem->max_seconds = options.lockstep ? 0 : options.global_ba.max_seconds;
  problem->t = map.keyframe(map.newestKeyframe()).data->frame.t;
  job.problem = problem;
  return job;
}

bool BackEnd::Impl::takeGlobal(const GbaResult& result) {
  if (result.correction != global.correction()) {
    // The map has been corrected or replaced since the job was copied: adjust again.
    if (result.solution && !map.empty()) global.want();
  } else if (frozen()) {
    if (result.solution) global.want();  // adjust again when mapping goes on
  } else if (result.solution && result.solution->summary.usable) {
    // Without newer keyframes T_map_odom comes from the last localisation and follows its matched keyframe.
    const TrackedFrame& newest = map.keyframe(map.newestKeyframe()).data->frame;
    const bool found = localisation.last_found && localisation.last_found->epoch == odometry.epoch() &&
                       map.hasKeyframe(localisation.last_found->match) &&
                       !(newest.epoch == odometry.epoch() && newest.t > localisation.last_found->t);
    const SE3 match_before = found ? map.keyframe(localisation.last_found->match).state.T_W_I : SE3();
    mergeGlobalBa(*result.solution, sensor.imu_noise, &map);
    report.statistics.outliers += result.solution->outliers.size();
    if (found) {
      // The newest keyframe is older than the localisation, and the odometry has drifted since.
      odometry.move(alignLevelled(map.keyframe(localisation.last_found->match).state.T_W_I, match_before));
    } else {
      odometry.follow(map);
    }
    askForScale();
    return true;
  } else if (result.solution) {
    report.refusals.add("result of the global adjustment: " + result.solution->summary.message);
  }
  return false;
}

MapUpdate BackEnd::Impl::globalUpdate(bool moved) {
  MapUpdate update = beginUpdate(0);
  if (moved) fillGlobal(&update);
  finishUpdate(&update);
  return update;
}

}  // namespace vip_slam
