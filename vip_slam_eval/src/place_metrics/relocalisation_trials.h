// Relocalisation of one session in the stored map of another, as the back end does it: each keyframe of the query
// begins a trial that knows nothing, is given the keyframes of the next second one by one, and ends with the first
// answer.
#pragma once

#include <string>
#include <vector>

#include "place_metrics/true_poses.h"
#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_core/sensor/sensor_config.h"

namespace vip_slam {

/// What the map has of a view, by the true poses: judged without any matching.
struct MappedView {
  /// Largest share of the query's depth image that a keyframe of the map within 2 m and 30 degrees shows too.
  double overlap = 0;
  int corners = 0;  ///< most corners with a known position that such a keyframe has in the query's view
};

struct RelocalisationTrial {
  KeyframeId first = 0;  ///< keyframe that begins it
  double t = 0;
  MappedView view;  ///< of that keyframe
  bool found = false;
  double seconds = 0;           ///< until the answer
  double error = 0, angle = 0;  ///< of the answer against the truth: metres, radians
  std::string reason;           ///< of the last keyframe tried
};

MappedView mappedView(const Map& map, const TruePoses& truth, const SE3& T_truth_map, const Keyframe& query,
                      const SE3& T_truth_I, const CameraModel& camera);

std::vector<RelocalisationTrial> relocalisationTrials(const StoredMap& stored, const TruePoses& truth,
                                                      const StoredMap& query, const TruePoses& query_truth,
                                                      const SensorConfig& sensor, const LoopOptions& options);

}  // namespace vip_slam
