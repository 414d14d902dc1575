// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/optimisation/problem_builder.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "gauges.h"
#include "landmark_views.h"
#include "odometry_factors.h"
#include "pixel_noise.h"
#include "plane_factors.h"
#include "shared_depth.h"

namespace vip_slam {
namespace {

/// As learnt last; a poor camera's for a map that was only loaded.
DepthNoiseParts noiseOfThisSession(const Map& map) {
  for (auto it = map.keyframes().rbegin(); it != map.keyframes().rend(); ++it)
    if (!it->second.stored) return it->second.data->depth_noise;
  return {};
}

}  // namespace

BuiltProblem buildProblem(const Map& map, const ProblemScope& scope, const BuilderSettings& settings) {
  BuiltProblem built;
  BaProblem& problem = built.problem;
  problem.gravity = settings.gravity;
  problem.huber = settings.measurement.huber;
  problem.depth_huber = settings.measurement.depth_huber;

  // Frames, ascending; fixed and free interleaved by id.
  std::unordered_map<KeyframeId, int> index;
  {
    std::vector<std::pair<KeyframeId, bool>> all;
    for (const KeyframeId id : scope.free) all.emplace_back(id, false);
    for (const KeyframeId id : scope.fixed) all.emplace_back(id, true);
    std::sort(all.begin(), all.end());
    for (const auto& entry : all) {
      const MapKeyframe& kf = map.keyframe(entry.first);
      BaFrame frame;
      frame.state = kf.state;
      frame.T_I_C = kf.T_I_C;
      frame.fixed = entry.second;
      index[entry.first] = static_cast<int>(problem.frames.size());
      problem.frames.push_back(frame);
      built.frames.push_back(entry.first);
    }
  }
  for (std::size_t f = 0; f < built.frames.size(); ++f) {
    const MapKeyframe& kf = map.keyframe(built.frames[f]);
    const auto previous = index.find(kf.previous);
    if (previous == index.end()) continue;
    if (problem.frames[f].fixed && problem.frames[previous->second].fixed) continue;
    BaRelativePose odometry;
    if (odometryFactor(kf, previous->second, static_cast<int>(f), settings.measurement, &odometry))
      problem.relative_poses.push_back(odometry);
    if (!kf.preintegration) continue;
    BaImu imu;
    imu.i = previous->second;
    imu.j = static_cast<int>(f);
    imu.preintegration = kf.preintegration;
    problem.imu.push_back(imu);
  }

  const PixelNoise noise(settings.measurement, settings.focal);
  built.gate_weight = 1.0 / noise.gateSigma();
  const LandmarkViews views(map, scope, built.frames, noise);
  built.depth_noise = noiseOfThisSession(map);
  PlaneFactorBuilder planes(map, scope, settings, &built);
  const std::vector<char> on_plane = planes.addHomographies(views);
  for (int l = 0; l < views.size(); ++l) {
    const MapLandmark& landmark = views.landmark(l);
    if (on_plane[l] && settings.variant == Variant::kVip) {
      if (views.standsForLandmark(l)) built.plane_points.push_back(landmark.id);
      continue;
    }
    BaPoint point;
    point.p_W = landmark.p_W;
    point.first = static_cast<int>(problem.observations.size());
    bool depth = false;
    for (const LandmarkView* v = views.begin(l); v != views.end(l); ++v) {
      BaObservation observation;
      observation.frame = v->frame;
      observation.x = v->xy.x();
      observation.y = v->xy.y();
      observation.weight = 1.0 / v->sigma;
      if (v->depth > 0) {
        observation.depth = v->depth;
        observation.depth_weight = 1.0 / (v->depth_sigma * settings.measurement.depth_sigma_scale);
        depth = true;
      }
      problem.observations.push_back(observation);
      built.observations.push_back({built.frames[v->frame], v->feature_index});
    }
    point.count = static_cast<int>(problem.observations.size()) - point.first;
    // One view does not constrain poses; two without depth depend on a baseline that may be zero.
    if (point.count < 2 || (point.count < 3 && !depth)) {
      problem.observations.resize(point.first);
      built.observations.resize(point.first);
      continue;
    }
    problem.points.push_back(point);
    built.points.push_back(landmark.id);
  }
  std::vector<double> times;
  for (const KeyframeId id : built.frames) times.push_back(map.keyframe(id).data->frame.t);
  shareDepthErrors(settings.depth_noise, built.depth_noise, times, &problem);
  planes.addDepthBlocks();
  addGauges(&problem);
  addMotionPriors(&problem);
  return built;
}

}  // namespace vip_slam
