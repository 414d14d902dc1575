// SPDX-License-Identifier: BSD-3-Clause
// Relocalisation of one session in the stored map of another, as the back end does it: a trial starts at each keyframe
// of the query session with no prior pose, receives the keyframes of the next second one by one, and ends with the
// first pose found.
#pragma once

#include <string>
#include <vector>

#include "place_metrics/true_poses.h"
#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_core/sensor/sensor_config.h"

namespace vip_slam {

/// How much of a view the map covers, computed from the true poses and without any matching.
struct MappedView {
  /// Largest share of the query's depth image that is also seen by one keyframe of the map within 2 m and 30 degrees.
  double overlap = 0;
  int corners = 0;  ///< most map points of one such keyframe that project into the query's image
};

struct RelocalisationTrial {
  KeyframeId first = 0;  ///< keyframe at which the trial starts
  double t = 0;
  MappedView view;  ///< of that keyframe
  bool found = false;
  double seconds = 0;           ///< until a pose was found
  double error = 0, angle = 0;  ///< of the found pose against the truth: metres, radians
  std::string reason;           ///< of the last keyframe tried
};

MappedView mappedView(const Map& map, const TruePoses& truth, const SE3& T_truth_map, const Keyframe& query,
                      const SE3& T_truth_I, const CameraModel& camera);

std::vector<RelocalisationTrial> relocalisationTrials(const StoredMap& stored, const TruePoses& truth,
                                                      const StoredMap& query, const TruePoses& query_truth,
                                                      const SensorConfig& sensor, const LoopOptions& options);

}  // namespace vip_slam
