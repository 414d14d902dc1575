// SPDX-License-Identifier: BSD-3-Clause
// The back end: map, local and global bundle adjustment, loop closing. ROS-free; the nodelet, the offline runner and
// the tests use exactly this class. One owner thread calls it; run() may be called from any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_backend/map/map_snapshot.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_core/types/plane_map.h"
#include "vip_slam_core/util/timing.h"

namespace vip_slam {

class Map;
struct GlobalBaProblem;  // optimisation/global_ba.h
struct GlobalBaSolution;

/// A global bundle adjustment to run in any thread: a copy of all it needs.
struct GbaJob {
  std::shared_ptr<const GlobalBaProblem> problem;  ///< null: nothing to do
  std::uint64_t correction = 0;                    ///< the map's correction count when it was copied
};
struct GbaResult {
  std::shared_ptr<const GlobalBaSolution> solution;  ///< null: none
  std::uint64_t correction = 0;                      ///< that of the job
};

class BackEnd {
 public:
  /// `sensor.camera` must be filled. Throws std::invalid_argument naming the option or sensor field that is unusable,
  /// std::runtime_error when the vocabulary cannot be read.
  BackEnd(const BackEndOptions& options, const SensorConfig& sensor, TimingLog* log = nullptr);
  ~BackEnd();
  BackEnd(const BackEnd&) = delete;
  BackEnd& operator=(const BackEnd&) = delete;

  /// Inserts, re-observes local landmarks, optimises the window, looks for loops. A keyframe that is refused leaves the
  /// map as it was: the update then has no keyframes and lastRefusal() says why.
  MapUpdate addKeyframe(KeyframePtr keyframe);
  const std::string& lastRefusal() const;
  /// Why keyframes, planes and observations were refused since the last call, oldest first, at most the last thousand.
  std::vector<std::string> takeRefusals();
  /// What was bridged instead of refused since the last call, such as a hole in a keyframe's IMU samples; likewise.
  std::vector<std::string> takeNotices();
  /// Applies the plane module's changes; they take effect with the next optimisation. Planes and observations that are
  /// unusable are refused one by one.
  void applyPlaneUpdate(const PlaneUpdate& update);

  /// True after an accepted loop or requestGlobalBa(), until startGlobalBa(); never in localisation-only mode.
  bool globalBaWanted() const;
  /// Makes globalBaWanted() true.
  void requestGlobalBa();
  /// Clears the request, adopts the newest camera and gyro corrections for all keyframes of this session, and copies
  /// the map. The job has no problem with fewer than two keyframes.
  GbaJob startGlobalBa();
  /// Solves a job; does not change the map.
  GbaResult run(const GbaJob& job) const;
  /// Merges the result with what has changed in the map meanwhile. Discarded, and requested again, when the map was
  /// corrected, loaded or reset since the job was copied.
  MapUpdate merge(const GbaResult& result);
  /// Keyframes that wait for a loaded map to be recognised are made a part of the map of its own, at a guessed place,
  /// which a loop may tie to the rest later; to be called before the map is saved or finish() ends it. None when no
  /// keyframe waits, or in localisation-only mode.
  std::optional<MapUpdate> mapWaiting();
  /// End of the data: a last global bundle adjustment when options.global_ba.at_end.
  MapUpdate finish();

  MapSnapshot snapshot() const;
  /// Scale of the map according to the accelerometer; computed after each global adjustment and every 30 keyframes.
  InertialScale scale() const;
  /// Correction of the depth camera estimated from the map, applied after that of the sensor's configuration.
  const DepthCurve& depthCurve() const;
  /// Message to the user about the depth correction when it is large enough to matter; empty otherwise.
  std::string depthDifference() const;
  /// 1/m: common disparity error that is part of the curve, see disparity_curve.h; 0: none.
  double disparityError() const;
  const Map& map() const;
  /// Without what mapWaiting() would add. Throws std::runtime_error naming the path when the file cannot be written.
  void saveMap(const std::string& path) const;
  /// Replaces the map; keyframes enter it once it is recognised. Throws std::runtime_error, the map unchanged, on a bad
  /// file or a map made with another camera.
  MapUpdate loadMap(const std::string& path);
  /// All planes of the map, for a plane module that starts from it.
  std::vector<StoredPlane> storedPlanes() const;
  /// Discards map, odometry and learnt corrections; revisions go on. Cannot fail.
  void reset();
  /// On: keyframes are localised in the map without changing it; without a map they are refused. Off: mapping goes on.
  void setLocalisationMode(bool on);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vip_slam
