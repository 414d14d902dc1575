// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/calibration.h"

#include "vip_slam_ros/camera_info.h"
#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {

vip_slam_msgs::Calibration toCalibrationMsg(const SensorConfig& sensor, double t, const std::string& camera_frame) {
  vip_slam_msgs::Calibration msg;
  msg.header.stamp = toStamp(t);
  msg.header.frame_id = camera_frame;
  msg.camera = toCameraInfo(sensor.camera);
  msg.camera.header = msg.header;
  msg.imu_camera = toPoseMsg(sensor.T_imu_cam);
  msg.base_imu = toPoseMsg(sensor.T_base_imu);
  return msg;
}

void applyCalibration(const vip_slam_msgs::Calibration& msg, SensorConfig* sensor) {
  sensor->camera = intrinsicsFromCameraInfo(msg.camera);
  sensor->T_imu_cam = fromMsg(msg.imu_camera);
  sensor->T_base_imu = fromMsg(msg.base_imu);
}

}  // namespace vip_slam
