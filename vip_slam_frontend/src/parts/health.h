// SPDX-License-Identifier: BSD-3-Clause
// What the newest pose is worth: the tracking state, its reason, and all clocks that decide on them.
#pragma once

#include <string>

#include "vip_slam_core/types/tracking_state.h"
#include "vip_slam_frontend/filter/vio_filter.h"
#include "vip_slam_frontend/front_end.h"
#include "vip_slam_frontend/front_end_options.h"
#include "vip_slam_frontend/tracking/predicted_motion.h"

namespace vip_slam::frontend {

/// What one image says about its pose.
struct Sight {
  double t = 0, t_imu = 0;          ///< its stamp on the image clock and on the IMU's, s
  int tracked = 0, with_depth = 0;  ///< points
  int old_with_depth = 0;           ///< points with depth that have been tracked for some images
  bool pose_ok = false;             ///< points with depth agree on one motion
  bool moves_by_itself = false;     ///< what is seen moves independently of the camera
  bool surfaces_hold = false;       ///< depth surfaces measured the motion
  bool still = false;               ///< the body stands still
  bool contradicts_imu = false;     ///< the IMU's adapted noise is implausible
  bool blind = false;               ///< no IMU tells the motion
  bool vertical_unknown = false;    ///< the IMU contradicts from its first motion on
  bool scale_contradicts = false;   ///< the accelerometer is sure of another scale of depth, beyond belief
  bool disputed = false;            ///< predictions and updates of the last second contradict each other
  double variance = 0;              ///< largest of the position, m^2
};

class Health {
 public:
  /// `counters`: its rows coasting and lost are counted.
  Health(const RecoveryOptions& options, FrontEndCounters* counters) : options_(options), counters_(counters) {}

  const TrackingStatus& status() const { return status_; }
  bool waiting() const { return phase_ == Phase::kWaiting; }
  bool tracking() const { return phase_ == Phase::kTracking; }
  bool lost() const { return phase_ == Phase::kLost; }
  /// Whether the points have been too few for so long that their depth tells nothing of where to look for them.
  bool coasts(double t) const { return lost() || t - last_good_t_ > kMoment; }

  /// Waits for a first image; `reason` is said.
  void reset(const std::string& reason);
  /// An image that did not lead to a start yet, and why.
  void initialising(const std::string& reason);
  void start(double t, double variance);

  /// The gyro reached the limit of its range, rad/s, before the image at t_imu.
  void noteCutOff(double t_imu, double range) { cut_off_imu_t_ = t_imu, gyro_range_ = range; }
  /// There were no IMU samples before the image at t_imu.
  void noteSilence(double t_imu) { silent_imu_t_ = t_imu; }
  /// The IMU was at fault before the image at t_imu.
  void noteFault(double t_imu) { fault_t_ = t_imu; }
  /// What is known of the IMU's fault from the start on; empty: nothing.
  void setImuFault(const std::string& what) { imu_fault_ = what; }

  /// Reason why the estimate can no longer be trusted after an update; empty when it can.
  std::string divergence(const StepReport& report, const Sight& sight);
  /// Judges the tracking state and ends LOST when features are back. False when the position is too uncertain by then.
  bool resume(const Sight& sight);
  /// An image that cannot be used, and why. LOST once nothing has carried the pose for too long: `imu_ended`, or the
  /// last state is `unseen` s old.
  TrackingState unusable(const std::string& why, bool imu_ended, double unseen);

 private:
  enum class Phase { kWaiting, kInitialising, kTracking, kLost };

  /// Growth of the position's one sigma since the last image with enough features, m.
  double coastedSigma(double variance) const;
  /// Whether what is seen has contradicted the IMU for so long that tracking must restart.
  bool contradictedForLong(const Sight& sight) const;
  void judge(const Sight& sight);
  /// What limits a pose that features hold; empty: nothing.
  std::string degradation(const Sight& sight) const;

  RecoveryOptions options_;
  FrontEndCounters* counters_;
  Phase phase_ = Phase::kWaiting;
  TrackingStatus status_{TrackingState::kWaiting, "waiting for the first image"};
  // Times of the last image with ...
  double last_good_t_ = 0;           ///< enough features
  double last_held_t_ = 0;           ///< enough features or matched depth surfaces
  double last_metric_t_ = 0;         ///< a part of depth in the update
  double last_disputed_t_ = -1e300;  ///< the motion was in dispute
  double last_points_t_ = 0;         ///< enough points that have depth
  double last_agreed_t_ = 0;         ///< points that agree with the IMU
  double last_good_variance_ = 0;    ///< of the position at last_good_t_, m^2
  double cut_off_imu_t_ = -1e300;    ///< the gyro at the limit of its range before it
  double silent_imu_t_ = -1e300;     ///< no IMU samples before it
  double fault_t_ = -1e300;          ///< the IMU at fault before it
  double gyro_range_ = 0;            ///< that limit, rad/s
  std::string imu_fault_;
};

}  // namespace vip_slam::frontend
