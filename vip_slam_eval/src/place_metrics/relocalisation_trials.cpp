// SPDX-License-Identifier: BSD-3-Clause
#include "place_metrics/relocalisation_trials.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_backend/loop/guided_matching.h"
#include "vip_slam_backend/relocalisation/relocaliser.h"

namespace vip_slam {
namespace {

constexpr double kTrialSeconds = 1.0, kMappedMetres = 2.0;

// Share of the query's depth grid nodes that lie on surfaces seen by the other depth image; T_o_q: query camera to
// other camera.
double sharedView(const DepthGrid& query, const DepthGrid& other, const SE3& T_o_q, const CameraModel& camera) {
  int nodes = 0, shared = 0;
  for (int r = 0; r < query.rows; ++r)
    for (int c = 0; c < query.cols; ++c) {
      const double z = query.at(c, r);
      if (z <= 0) continue;
      ++nodes;
      const Eigen::Vector3d p = T_o_q * camera.unproject(query.pixel(c, r), z);
      Eigen::Vector2d uv;
      if (p.z() < 0.2 || !camera.project(p, &uv) || !camera.inImage(uv)) continue;
      const int oc = static_cast<int>(std::lround((uv.x() - other.offset) / other.stride));
      const int orow = static_cast<int>(std::lround((uv.y() - other.offset) / other.stride));
      if (oc < 0 || orow < 0 || oc >= other.cols || orow >= other.rows) continue;
      const double there = other.at(oc, orow);
      shared += there > 0 && std::abs(there - p.z()) < 0.1 + 0.05 * p.z();
    }
  return nodes ? static_cast<double>(shared) / nodes : 0;
}

}  // namespace

MappedView mappedView(const Map& map, const TruePoses& truth, const SE3& T_truth_map, const Keyframe& query,
                      const SE3& T_truth_I, const CameraModel& camera) {
  MappedView view;
  const SE3 T_truth_C = T_truth_I * query.frame.T_I_C, T_C_map = T_truth_C.inverse() * T_truth_map;
  for (const auto& other : truth) {
    if (!samePlace(T_truth_I, other.second, kMappedMetres)) continue;
    const MapKeyframe& kf = map.keyframe(other.first);
    const SE3 T_o_q = (other.second * kf.T_I_C).inverse() * T_truth_C;
    view.overlap = std::max(view.overlap, sharedView(query.frame.depth_grid, kf.data->frame.depth_grid, T_o_q, camera));
    int corners = 0;
    for (const MapPoint& point : mapPointsOf(map, {other.first})) {
      const Eigen::Vector3d p_C = T_C_map * point.p_W;
      Eigen::Vector2d uv;
      corners += p_C.z() > 0.2 && camera.project(p_C, &uv) && camera.inImage(uv);
    }
    view.corners = std::max(view.corners, corners);
  }
  return view;
}

std::vector<RelocalisationTrial> relocalisationTrials(const StoredMap& stored, const TruePoses& truth,
                                                      const StoredMap& query, const TruePoses& query_truth,
                                                      const SensorConfig& sensor, const LoopOptions& options) {
  const std::shared_ptr<const CameraModel> camera = makeCamera(sensor.camera);
  LoopCloser places(options, camera);
  places.rebuild(stored.map, stored.loops);
  const SE3 T_truth_map = alignMap(stored.map, truth);
  std::vector<RelocalisationTrial> trials;
  for (auto begin = query_truth.begin(); begin != query_truth.end(); ++begin) {
    const KeyframePtr& first = query.map.keyframe(begin->first).data;
    RelocalisationTrial trial;
    trial.first = begin->first;
    trial.t = first->frame.t;
    trial.view = mappedView(stored.map, truth, T_truth_map, *first, begin->second, *camera);
    Relocaliser relocaliser(options.relocalisation);
    for (auto next = begin; next != query_truth.end() && !trial.found; ++next) {
      const KeyframePtr& keyframe = query.map.keyframe(next->first).data;
      if (keyframe->frame.t > trial.t + kTrialSeconds) break;
      const auto found = relocaliser.relocalise(stored.map, places, keyframe, {}, &trial.reason);
      if (!found) continue;
      trial.found = true;
      trial.seconds = keyframe->frame.t - trial.t;
      const SE3 T = T_truth_map * found->T_W_I;
      trial.error = (T.t() - next->second.t()).norm();
      trial.angle = T.rotation().angularDistance(next->second.rotation());
    }
    trials.push_back(std::move(trial));
  }
  return trials;
}

}  // namespace vip_slam
