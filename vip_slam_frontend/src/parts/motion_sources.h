// SPDX-License-Identifier: BSD-3-Clause
// What tells the motion between two images: the IMU, all pixels, the points with depth; which of them is believed.
#pragma once

#include <memory>
#include <optional>

#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_frontend/filter/vio_filter.h"
#include "vip_slam_frontend/front_end_options.h"
#include "vip_slam_frontend/inertial/fault_detection.h"
#include "vip_slam_frontend/inertial/imu_trial.h"
#include "vip_slam_frontend/inertial/inertial_input.h"
#include "vip_slam_frontend/tracking/dense_alignment.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"

#include "parts/depth_input.h"

namespace vip_slam::frontend {

class MotionSources {
 public:
  /// Reads `filter` and gives stand-ins to `inertial`; both outlive this.
  MotionSources(const SensorConfig& sensor, std::shared_ptr<const CameraModel> camera, const VioFilter* filter,
                InertialInput* inertial);

  /// Camera motion between the last two images, T_current_previous.
  const SE3& last() const { return last_; }
  void setLast(const SE3& T_current_previous) { last_ = T_current_previous; }

  /// The motion since the tracker's image, `seconds` before this one, by all pixels.
  std::optional<AlignedMotion> byPixels(const FeatureTracker& tracker, const cv::Mat& gray, const DepthReading& depth,
                                        double seconds) const;
  /// Where the images cannot be aligned: the motion that goes on.
  AlignedMotion goingOn() const;
  /// Rotation of the camera between two IMU times by the gyro alone.
  SE3 byGyro(double t0, double t1) const;
  /// The IMU's rate at t (IMU clock), rad/s, bias included; the nearest one outside of what is buffered.
  Eigen::Vector3d rate(double t) const;
  /// The camera's motion since the last image as predicted by the IMU. Where samples are missing or cut off,
  /// `imu_missing`, it does not judge the points. `wary`: a moving body was seen lately; `at_rest`: by the IMU.
  PredictedMotion byImu(const Propagation& propagation, const SE3& T_odom_C, bool imu_missing, bool wary,
                        bool at_rest) const;
  /// Whether all pixels see another turn than `predicted`, which is too large for optical flow to find the difference.
  bool isAnotherTurn(const AlignedMotion& seen, const SE3& predicted) const;
  static bool isBeyondFlow(const SE3& motion);

  /// Gives the interval between two images stand-ins for the inertial channels that there are not, or for `both`: the
  /// turn between the images, and a constant velocity of `state`.
  void substitute(double t0, double t1, const SE3& T_current_previous, const NavState& state, bool both) const;
  /// Stand-ins for the IMU over the interval since the last image by the motion of the camera that images show, and the
  /// prediction with them. `points`: by points; `pixels`: by all pixels.
  Propagation byImages(double t_imu, const MotionFit& points, const AlignedMotion& pixels) const;
  /// Widens the prediction by a gyro at the limit of its range over [from, t_imu]; true when it was.
  bool admitCutOff(double from, double t_imu, Propagation* propagation) const;

  /// Whether the IMU was at fault a moment before t (IMU clock).
  bool suspectImu(double t) const { return inertial_->complete() && faults_.suspects(t); }
  /// Whether the IMU is at fault in the interval before this image (fault_detection.h).
  bool imuIsAtFault(const TrackingResult& tracking, const PredictedMotion& prediction, const Propagation& propagation);
  /// Whether the IMU has contradicted the images from its first motion on, so that the vertical is not known.
  bool verticalUnknown() const { return faults_.verticalUnknown(); }
  /// Whether the image after a gap of IMU and images shows the motion in between: enough tracks have survived, and the
  /// rotation is near the predicted one.
  static bool bridgesGap(const TrackingResult& tracking, std::size_t tracks_before, const PredictedMotion& prediction);

  /// The first state, at t_imu: until its velocity is confirmed, its error cannot be told from a shock.
  /// `at_fault`: its IMU is wrong.
  void start(double t_imu, bool at_fault);
  void reset();

 private:
  ImuNoise imu_noise_;
  double gravity_;  ///< m/s^2
  const VioFilter* filter_;
  InertialInput* inertial_;
  DenseAlignment dense_;
  FaultDetection faults_;
  ImuTrial trial_;
  SE3 last_;
};

}  // namespace vip_slam::frontend
