// SPDX-License-Identifier: BSD-3-Clause
#include "calibration_source.h"

#include <ros/console.h>

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_ros/camera_info.h"
#include "vip_slam_ros/tf_lookup.h"

namespace vip_slam {

CalibrationSource::CalibrationSource(const SensorConfig& sensor, const FrontEndNodeOptions& options,
                                     const tf2::BufferCore& tf)
    : sensor_(sensor), options_(options), tf_(tf) {}

void CalibrationSource::addColorInfo(const sensor_msgs::CameraInfo& info) {
  std::lock_guard<std::mutex> lock(mutex_);
  take(info, sensor_.topics.color_info, sensor_.topics.color, &sensor_.camera, &color_info_);
}

void CalibrationSource::addDepthInfo(const sensor_msgs::CameraInfo& info) {
  std::lock_guard<std::mutex> lock(mutex_);
  take(info, sensor_.topics.depth_info, sensor_.topics.depth, &sensor_.depth_camera, &depth_info_);
}

void CalibrationSource::take(const sensor_msgs::CameraInfo& info, const std::string& topic,
                             const std::string& image_topic, CameraIntrinsics* camera, bool* known) {
  if (*known) return;
  try {
    *camera = intrinsicsFromCameraInfo(info, image_topic);
    *known = true;
    problem_.clear();
    const std::string note = cameraInfoNote(info);
    if (!note.empty()) ROS_WARN("topic %s: %s", topic.c_str(), note.c_str());
  } catch (const std::exception& error) {
    problem_ = "topic " + topic + ": " + error.what();
  }
}

void CalibrationSource::addColorFrame(const std::string& frame_id) {
  std::lock_guard<std::mutex> lock(mutex_);
  color_frame_ = frame_id;
  color_seen_ = true;
}

void CalibrationSource::addImuFrame(const std::string& frame_id) {
  std::lock_guard<std::mutex> lock(mutex_);
  imu_frame_ = frame_id;
  imu_seen_ = true;
}

bool CalibrationSource::intrinsicsKnown() const {
  if (!sensor_.intrinsics_from_camera_info) return true;
  return color_info_ && (sensor_.depth_registered || depth_info_);
}

std::optional<SensorConfig> CalibrationSource::resolve(double t) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!intrinsicsKnown()) {
    const std::string& topic = color_info_ ? sensor_.topics.depth_info : sensor_.topics.color_info;
    waiting_for_ = problem_.empty() ? "no camera_info on topic " + topic + " yet" : problem_;
    return std::nullopt;
  }
  const bool inertial = sensor_.topics.hasInertial();
  if (inertial && !imu_seen_) {
    waiting_for_ = "no IMU message on topic " + sensor_.topics.inertial() + " yet";
    return std::nullopt;
  }
  if (options_.extrinsics != "config") {
    // The frame to look up in tf is known only from an image: wait for a camera that starts late.
    if (!color_seen_) {
      waiting_for_ = "no image on topic " + sensor_.topics.color + " yet";
      return std::nullopt;
    }
    if (!asked_since_ || t < *asked_since_) asked_since_ = t;
    // Without an IMU the body is where the sensor file puts it, seen from the camera: tf has only the base to tell.
    const std::optional<SE3> T_imu_cam = inertial ? lookUpExtrinsics(tf_, imu_frame_, color_frame_) : sensor_.T_imu_cam;
    const std::string& frame = inertial ? imu_frame_ : color_frame_;
    auto T_base_imu = lookUpTransform(tf_, options_.base_frame, frame);
    T_base_body_read_ = T_base_imu;
    if (inertial) T_imu_cam_read_ = T_imu_cam;
    if (T_base_imu && !inertial) T_base_imu = *T_base_imu * sensor_.T_imu_cam.inverse();
    const bool patient = options_.extrinsics == "tf" || t - *asked_since_ < options_.tf_patience;
    const std::string no_base = "tf does not connect '" + frame + "' to '" + options_.base_frame + "'";
    if (!(T_imu_cam && T_base_imu) && patient) {
      waiting_for_ = T_imu_cam ? no_base : whyNoExtrinsics(imu_frame_, color_frame_);
      return std::nullopt;
    }
    if (T_imu_cam) sensor_.T_imu_cam = *T_imu_cam;
    if (T_base_imu) sensor_.T_base_imu = *T_base_imu;
    origin_ = !inertial   ? "T_imu_cam: the sensor file's, there is no IMU"
              : T_imu_cam ? "T_imu_cam: from tf"
                          : "T_imu_cam: the sensor file's, " + whyNoExtrinsics(imu_frame_, color_frame_);
    origin_ += "; T_base_imu: " + (T_base_imu ? "from tf" : "the sensor file's, " + no_base);
    tf_incomplete_ = !(T_imu_cam && T_base_imu);
  } else {
    origin_ = "T_imu_cam and T_base_imu: the sensor file's";
  }
  const std::string wrong = inertial ? leverArmProblem(sensor_.T_imu_cam, options_.input.max_lever_arm) : "";
  if (!wrong.empty()) {
    waiting_for_ = "T_imu_cam: " + wrong + " (" + origin_ + ")";
    return std::nullopt;
  }
  waiting_for_.clear();
  return sensor_;
}

std::string CalibrationSource::extrinsicsOrigin() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return origin_;
}

bool CalibrationSource::tfIsIncomplete() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return tf_incomplete_;
}

std::string CalibrationSource::waitingFor() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return waiting_for_;
}

std::string CalibrationSource::movedInTf() const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto moved = [&](const std::optional<SE3>& read, const std::string& target, const std::string& source) {
    const std::optional<SE3> now = read ? lookUpTransform(tf_, target, source) : std::nullopt;
    if (!now) return std::string();
    const ExtrinsicsGap gap = extrinsicsGap(*read, *now);
    if (!gap.large()) return std::string();
    return formatted(
        "tf has moved '%s' against '%s' by %.1f degrees and %.1f cm since it was read: on a moving part, as a "
        "pan head? poses are of '%s' as it was then; name a base_frame that is fixed to the camera",
        source.c_str(), target.c_str(), gap.degrees, 100 * gap.metres, target.c_str());
  };
  const std::string& body = sensor_.topics.hasInertial() ? imu_frame_ : color_frame_;
  const std::string camera = moved(T_imu_cam_read_, imu_frame_, color_frame_);
  return camera.empty() ? moved(T_base_body_read_, options_.base_frame, body) : camera;
}

std::string CalibrationSource::colorFrame() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return color_frame_;
}

}  // namespace vip_slam
