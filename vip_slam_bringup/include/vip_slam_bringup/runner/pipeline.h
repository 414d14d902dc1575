// SPDX-License-Identifier: BSD-3-Clause
// The estimators in lock-step: sensor events are input, poses are output, with bit-identical results each time.
//
// The front end runs in the calling thread, planes and back end in their own thread. The back end's update for a
// keyframe is applied to the front end a fixed number of images later, whenever it is computed, so that the result does
// not depend on timing. With a lag of 0 the front end waits for it.
#pragma once

#include <cstdint>
#include <deque>
#include <future>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_bringup/runner/mapping_thread.h"
#include "vip_slam_bringup/runner/pipeline_options.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/trajectory/anchored_trajectory.h"
#include "vip_slam_core/trajectory/time_passes.h"
#include "vip_slam_core/types/tracking_state.h"
#include "vip_slam_core/util/timing.h"
#include "vip_slam_frontend/front_end.h"
#include "vip_slam_ros/stream_time/machine_clock.h"

namespace vip_slam {

struct StateChange {
  double t;
  TrackingStatus status;
  std::size_t images = 1;  ///< from this one on, until the state changes
};

/// An image's pose as published by the front end.
struct OdometryPose {
  double t = 0;  ///< of the image, seconds
  std::uint32_t epoch = 0;
  SE3 T_odom_I;
};

/// The front end's reported covariance, ordered as in nav_msgs/Odometry: x y z in odom, then rotation about the axes of
/// odom.
struct OdometryCovariance {
  double t;
  Matrix6d covariance;
};

class Pipeline {
 public:
  Pipeline(const PipelineOptions& options, const SensorConfig& sensor, TimingLog* timing);
  ~Pipeline();

  /// To be called before the first event: starts with a stored map, and with `localise` does not change it.
  void loadMap(const std::string& path, bool localise);
  void add(const SensorEvent& event);
  /// End of the data: processes the waiting images, and runs the last global adjustment.
  void finish();

  std::size_t images() const { return images_; }
  /// Time from the first to the last image by their stamps, seconds; the sum of the parts when the clock ran back.
  double duration() const {
    return newest_taken_ > oldest_taken_ ? duration_ + newest_taken_ - oldest_taken_ : duration_;
  }
  /// Images with a pose; in order of their stamps after finish(). Of stamps that repeat after the clock ran back, the
  /// first pass is used.
  const std::vector<OdometryPose>& odometry() const { return odometry_; }
  const std::vector<ChainedPose>& chain() const { return chain_; }                     ///< one for each of odometry()
  const std::vector<OdometryCovariance>& covariances() const { return covariances_; }  ///< one for each of odometry()
  const std::vector<StateChange>& states() const { return states_; }
  const TrackingStatus& status() const { return status_; }  ///< of the last image
  const Trajectory& realtime() const { return realtime_; }  ///< poses in map, as estimated at the time of each image
  /// The stamps of these times where the clock was set while recording.
  const MachineClock& machineClock() const { return machine_clock_; }
  const PipelineOptions& options() const { return options_; }
  const FrontEnd& frontEnd() const { return *front_end_; }
  const MappingThread* mapping() const { return mapping_.get(); }  ///< null: odometry only. Read it after finish()

 private:
  struct Answer {
    std::size_t due;  ///< number of the image before which it is applied
    std::future<std::vector<MapUpdate>> updates;
  };
  void applyAnswers(std::size_t image);
  void process(const ImagePair& pair);
  void processReady();
  void processRest();  ///< the waiting images, as far as the IMU covers them
  /// Stamps ran back: processes the waiting images and restarts the odometry.
  void restart(double seconds);
  /// Time by which the data has advanced past an image at `t`, seconds.
  double waitedFor(double t) const;

  const PipelineOptions options_;
  std::unique_ptr<FrontEnd> front_end_;
  std::unique_ptr<MappingThread> mapping_;
  std::deque<ImagePair> waiting_;
  std::deque<Answer> answers_;
  SE3 T_map_odom_;
  std::uint32_t epoch_ = 0;
  bool placed_ = false;                                 ///< T_map_odom_ is known for epoch_
  double newest_image_ = -1e300, newest_imu_ = -1e300;  ///< stamps, each on its own clock
  std::size_t images_ = 0;
  double duration_ = 0;                                            ///< of the images before the clock last ran back
  double oldest_taken_ = std::numeric_limits<double>::infinity();  ///< stamps of the images since then
  double newest_taken_ = oldest_taken_;
  TimePasses passes_;
  MachineClock machine_clock_;
  std::vector<OdometryPose> odometry_;
  std::vector<ChainedPose> chain_;
  std::vector<OdometryCovariance> covariances_;
  Trajectory realtime_;
  std::vector<StateChange> states_;
  TrackingStatus status_;
};

}  // namespace vip_slam
