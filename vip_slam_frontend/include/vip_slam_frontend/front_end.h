// SPDX-License-Identifier: BSD-3-Clause
// The front end: RGB-D-inertial odometry at image rate (paper section "Front End"). ROS-free; one owner thread.
//
// Images go in with process() in order of their stamps, IMU samples with addImu() (or addGyro()/addAccel() when the
// sensor splits them). Poses come out in `odom`, which starts at the first pose with yaw 0 and never jumps: what the
// back end corrects moves T_map_odom only.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_core/util/timing.h"
#include "vip_slam_frontend/filter/calibration_estimate.h"
#include "vip_slam_frontend/front_end_options.h"
#include "vip_slam_frontend/initialisation/floor_level.h"

namespace vip_slam {

struct FrameInput {
  double t = 0;   ///< image stamp, seconds
  cv::Mat gray;   ///< 8UC1, the size of the colour camera
  cv::Mat depth;  ///< 32FC1 metres registered to gray, 0 or NaN invalid; empty when there is none
  /// Stamp of depth - stamp of gray, seconds, not zero for cameras that are not synchronised. Depth is warped to the
  /// stamp of gray by the motion that the IMU predicts.
  double depth_lag = 0;
};

struct FrameOutput {
  TrackedFramePtr frame;  ///< never null; frame->status says how far it can be trusted
  KeyframePtr keyframe;   ///< null: this image is none
};

/// What was counted since construction, and present values of what is learnt (the last ten); for diagnostics.
struct FrontEndCounters {
  std::uint64_t images = 0, keyframes = 0, restarts = 0;
  std::uint64_t bad_image = 0;           ///< wrong size or type, or empty
  std::uint64_t bad_depth = 0;           ///< depth of wrong size or type: treated as none
  std::uint64_t no_depth = 0;            ///< images without depth
  std::uint64_t bad_stamp = 0;           ///< repeated, backward or non-finite image stamps
  std::uint64_t repeated_image = 0;      ///< new stamps on the pixels of the image before: not used
  std::uint64_t repeated_depth = 0;      ///< depth images with the pixels of the one before: left out
  std::uint64_t depth_unit_changes = 0;  ///< times that all readings changed by one factor: they are changed back
  std::uint64_t imu_rejected = 0;  ///< non-finite, all zero, repeated or backward samples, and those stamped too late
  std::uint64_t imu_gaps = 0;
  std::uint64_t imu_spikes = 0;        ///< single wrong samples, replaced
  std::uint64_t imu_faults = 0;        ///< images before which the IMU contradicted what is seen and was left out
  std::uint64_t gyro_cut_off = 0;      ///< samples at the limit of the gyro's range
  std::uint64_t imu_missing = 0;       ///< images not covered by the IMU
  std::uint64_t zero_velocity = 0;     ///< images taken standing still
  std::uint64_t coasting = 0;          ///< images passed on the IMU alone
  std::uint64_t moving = 0;            ///< images in which most of the view moved independently of the camera
  std::uint64_t lost = 0;              ///< times the state went to LOST
  std::uint64_t imu_contradicted = 0;  ///< images that contradict the IMU by more than any plausible noise of it
  std::uint64_t features_used = 0, features_gated = 0;
  std::uint64_t surfaces_used = 0;  ///< pairs of a depth reading and a flat patch of an earlier image
  std::uint64_t landmarks_reacquired = 0;
  frontend::Level level = frontend::Level::kAccelerometer;  ///< what the vertical of the last start was taken from
  double depth_unit = 1;                 ///< factor that brings readings to the unit of the first ones
  double missing_reading = 0;            ///< value of depth that stands for "no reading" beside 0, m; 0: none seen
  double sigma_px = 0;                   ///< adapted pixel noise
  double gyro_range = 0;                 ///< limit of the gyro's range, rad/s; 0: never reached
  double imu_noise_scale = 1;            ///< factor on the IMU's noise, see ImuNoiseMonitor
  double gyro_walk = 1, accel_walk = 1;  ///< factors on the random walks of its biases, see DriftMonitor
  double nis_per_dof = 0;                ///< of the last update; about 1 when consistent
  /// Learnt noise of depth on surfaces, as factors on the configured noise: of single patches, and common to a surface.
  double depth_white = 1, depth_shared = 1;
  /// Whether so many images contradict the IMU that what was learnt against it, such as its delay, is worth nothing.
  bool imuIsWrong() const { return 10 * (imu_faults + imu_contradicted) > images; }
};

class FrontEnd {
 public:
  /// Throws std::invalid_argument when sensor.camera is unusable or the mask does not fit it. `timing` may be null and
  /// must outlive this. A stamp that is more than `clock_jump` seconds back means a looped bag or a restarted clock,
  /// less a message out of order. `session`: see firstNumbers().
  FrontEnd(const FrontEndOptions& options, const SensorConfig& sensor, TimingLog* timing = nullptr,
           double clock_jump = 1.0, std::uint32_t session = 0);
  ~FrontEnd();
  FrontEnd(const FrontEnd&) = delete;
  FrontEnd& operator=(const FrontEnd&) = delete;

  /// False (and counted) when the sample is not finite, all zero, or not newer than the last; addGyro takes zeros.
  bool addImu(const ImuSample& sample);
  bool addGyro(double t, const Eigen::Vector3d& gyro);
  bool addAccel(double t, const Eigen::Vector3d& accel);
  /// Whether the IMU samples cover the image at t_image + time offset, and the depth image `depth_lag` s after it.
  bool ready(double t_image, double depth_lag = 0) const;

  /// Always returns a frame. Bad input is counted and named in its status; it never throws on data.
  /// `on_pose` (may be empty) is called as soon as an image that is tracked has its pose, before corners are renewed
  /// and a keyframe is made: whoever waits for the pose need not wait for those. Its frame has no features yet; its
  /// state, covariance and status are those of the frame that is returned.
  using PoseReady = std::function<void(const TrackedFrame&)>;
  FrameOutput process(const FrameInput& input, const PoseReady& on_pose = {});

  /// Landmarks of the map (so that features regain their id) and T_map_odom; odom does not move.
  void applyMapUpdate(const MapUpdate& update);

  /// The newest state integrated with the IMU to time t (IMU clock), in odom; empty before tracking starts.
  std::optional<NavState> predict(double t) const;
  /// Measured angular rate at time t (IMU clock), rad/s in the IMU frame, bias included, spikes replaced, scale
  /// corrected. Outside the buffered time span the nearest sample's; zero before the first sample.
  Eigen::Vector3d gyro(double t) const;
  /// Restarts the odometry in a new epoch; keyframe and landmark ids go on.
  void reset(const std::string& reason);
  /// Likewise, when the clock has jumped back: stamps to come precede those so far.
  void clockRanBack(const std::string& reason);
  /// The back end has discarded its map: its landmarks are not searched for any more.
  void forgetMap();

  /// Present estimate of the camera-IMU extrinsics, the time offset and the other calibration states.
  CalibrationEstimate calibration() const;
  /// The time offset of calibration(), s, without the cost of computing its sigmas.
  double timeOffset() const;
  /// The same calibration as given by the sensor's configuration.
  CalibrationEstimate givenCalibration() const;
  const FrontEndCounters& counters() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vip_slam
