// SPDX-License-Identifier: BSD-3-Clause
// Collects the calibration that the estimators need to start: intrinsics from camera_info or the sensor configuration,
// extrinsics from tf or the sensor configuration.
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include <sensor_msgs/CameraInfo.h>
#include <tf2/buffer_core.h>

#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_frontend/front_end_node_options.h"

namespace vip_slam {

/// Thread-safe.
class CalibrationSource {
 public:
  CalibrationSource(const SensorConfig& sensor, const FrontEndNodeOptions& options, const tf2::BufferCore& tf);

  void addColorInfo(const sensor_msgs::CameraInfo& info);
  void addDepthInfo(const sensor_msgs::CameraInfo& info);
  void addColorFrame(const std::string& frame_id);
  void addImuFrame(const std::string& frame_id);

  /// The completed configuration, once everything is known at time `t` (stamps, seconds).
  std::optional<SensorConfig> resolve(double t);
  /// Valid after resolve(): the source of the extrinsics as a sentence, and whether tf lacked one of the two
  /// transforms.
  std::string extrinsicsOrigin() const;
  bool tfIsIncomplete() const;
  /// What is missing, or what is wrong with the camera_info received, as a sentence.
  std::string waitingFor() const;
  std::string colorFrame() const;
  /// How far tf has moved camera, IMU and base against each other since resolve() read it, in words; empty while they
  /// are where they were, or did not come from tf.
  std::string movedInTf() const;

 private:
  void take(const sensor_msgs::CameraInfo& info, const std::string& topic, const std::string& image_topic,
            CameraIntrinsics* camera, bool* known);
  bool intrinsicsKnown() const;

  mutable std::mutex mutex_;
  SensorConfig sensor_;
  const FrontEndNodeOptions options_;
  const tf2::BufferCore& tf_;
  bool color_info_ = false, depth_info_ = false, color_seen_ = false, imu_seen_ = false;
  std::string color_frame_, imu_frame_, problem_, waiting_for_, origin_;
  bool tf_incomplete_ = false;
  std::optional<SE3> T_imu_cam_read_, T_base_body_read_;  ///< from tf; of the latter the IMU, or the camera without one
  std::optional<double> asked_since_;                     ///< time when both frame names were first known, s
};

}  // namespace vip_slam
