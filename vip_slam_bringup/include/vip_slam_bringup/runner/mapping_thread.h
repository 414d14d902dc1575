// SPDX-License-Identifier: BSD-3-Clause
// Planes and back end in their own thread: tasks are done in the order of their posting, so that the results do not
// depend on the speed of either thread.
#pragma once

#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <thread>
#include <vector>

#include "vip_slam_backend/back_end.h"
#include "vip_slam_bringup/runner/channel.h"
#include "vip_slam_bringup/runner/pipeline_options.h"
#include "vip_slam_bringup/runner/plane_history.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/util/timing.h"
#include "vip_slam_planes/plane_mapper.h"

namespace vip_slam {

struct GlobalBaRecord {
  double t = 0;  ///< stamp of the newest keyframe
  std::size_t keyframes = 0;
  double milliseconds = 0;
};

/// Back end and planes on a thread of their own; both are called in the order of the keyframes.
class MappingThread {
 public:
  /// `timing` may be null.
  MappingThread(const PipelineOptions& options, const SensorConfig& sensor, TimingLog* timing);
  ~MappingThread();
  MappingThread(const MappingThread&) = delete;
  MappingThread& operator=(const MappingThread&) = delete;

  /// To be called before the first keyframe: starts with a stored map. Throws std::runtime_error naming the file when
  /// it is unusable.
  MapUpdate loadMap(const std::string& path);
  /// Localisation-only mode from now on.
  void localiseOnly() { back_end_->setLocalisationMode(true); }

  void grow(TrackedFramePtr frame);
  /// Returns the map updates that result from the keyframe, in order. get() throws an exception of the estimators.
  std::future<std::vector<MapUpdate>> addKeyframe(KeyframePtr keyframe);
  /// Finishes the waiting tasks, then the last global adjustment. Afterwards the estimators may be read. Throws the
  /// exception of that, or of an earlier grow().
  void finish();

  const BackEnd& backEnd() const { return *back_end_; }
  std::vector<PlaneEstimate> planes() const;  ///< empty without planes
  const std::vector<GlobalBaRecord>& globalAdjustments() const { return adjustments_; }
  /// All planes after each map update, in order.
  const std::vector<PlaneRecord>& planeHistory() const { return plane_history_; }
  /// What the back end refused or bridged, and why.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  std::vector<MapUpdate> process(const KeyframePtr& keyframe);
  void distribute(const MapUpdate& update);

  TimingLog* const timing_;
  std::unique_ptr<PlaneMapper> planes_;  ///< null: a system without planes
  std::unique_ptr<BackEnd> back_end_;
  SE3 T_map_odom_;
  std::uint32_t epoch_ = 0;
  bool placed_ = false;
  std::vector<GlobalBaRecord> adjustments_;
  std::vector<PlaneRecord> plane_history_;
  std::vector<std::string> warnings_;
  std::exception_ptr failure_;  ///< exception of the thread, to be read after its end
  Channel<std::function<void()>> work_;
  std::thread thread_;
};

}  // namespace vip_slam
