// The back end: map, local and global bundle adjustment, loop closing. ROS-free; the nodelet, the offline runner and
// the tests use exactly this class. One owner thread calls it; run() may be called from any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

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

/// A global bundle adjustment to run elsewhere: a copy of all it needs.
struct GbaJob {
  std::shared_ptr<const GlobalBaProblem> problem;  ///< null: nothing to do
  std::uint64_t correction = 0;                    ///< how often the whole map had been moved when it was copied
};
struct GbaResult {
  std::shared_ptr<const GlobalBaSolution> solution;  ///< null: none
  std::uint64_t correction = 0;                      ///< of the job
};

class BackEnd {
 public:
  /// `sensor.camera` must be filled. Throws std::invalid_argument naming the option or sensor field that is unusable.
  BackEnd(const BackEndOptions& options, const SensorConfig& sensor, TimingLog* log = nullptr);
  ~BackEnd();
  BackEnd(const BackEnd&) = delete;
  BackEnd& operator=(const BackEnd&) = delete;

  /// Inserts, re-observes local landmarks, optimises the window, looks for loops. A keyframe that is refused leaves the
  /// map as it was: the update then has no keyframes and lastRefusal() says why.
  MapUpdate addKeyframe(KeyframePtr keyframe);
  const std::string& lastRefusal() const;
  /// The plane module's changes; used from the next optimisation on.
  void applyPlaneUpdate(const PlaneUpdate& update);

  /// True after an accepted loop or requestGlobalBa(), until startGlobalBa(); not while localising only.
  bool globalBaWanted() const;
  void requestGlobalBa();
  GbaJob startGlobalBa();
  GbaResult run(const GbaJob& job) const;
  /// Brings the result into the map together with what came meanwhile.
  MapUpdate merge(const GbaResult& result);
  /// End of the data: a last global bundle adjustment when options.global_ba.at_end.
  MapUpdate finish();

  MapSnapshot snapshot() const;
  /// How large the map is by the accelerometer; asked after each global adjustment and now and then in between.
  InertialScale scale() const;
  /// What the map has found out about the depth camera, after what the sensor's configuration adds.
  const DepthCurve& depthCurve() const;
  /// What to tell the user of them, when they are large enough to matter; empty else.
  std::string depthDifference() const;
  /// What to tell the user when the last adjustment found pixels to be off by more than they are told to be; empty
  /// else.
  std::string trackNoiseDifference() const;
  /// 1/m: the part of the curve that is for disparities which are all off, see disparity_curve.h.
  double disparityError() const;
  const Map& map() const;
  void saveMap(const std::string& path) const;
  MapUpdate loadMap(const std::string& path);
  /// All planes as a plane module takes them that starts from this map.
  std::vector<StoredPlane> storedPlanes() const;
  void reset();
  /// On: keyframes are found in the map and leave it as it is; without a map they are refused. Off: mapping goes on.
  void setLocalisationMode(bool on);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vip_slam
