// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/frame_conversions.h"

#include <algorithm>
#include <stdexcept>

#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {

vip_slam_msgs::TrackingStatus toMsg(const TrackingStatus& status) {
  vip_slam_msgs::TrackingStatus msg;
  msg.state = static_cast<std::uint8_t>(status.state);
  msg.reason = status.reason;
  return msg;
}

TrackingStatus fromMsg(const vip_slam_msgs::TrackingStatus& msg) {
  if (msg.state > vip_slam_msgs::TrackingStatus::LOST) {
    throw std::invalid_argument("TrackingStatus.state: " + std::to_string(msg.state) + ", expected 0 to 4");
  }
  return {static_cast<TrackingState>(msg.state), msg.reason};
}

vip_slam_msgs::ImuSample toMsg(const ImuSample& sample) {
  vip_slam_msgs::ImuSample msg;
  msg.t = sample.t;
  msg.gyro = toVectorMsg(sample.gyro);
  msg.accel = toVectorMsg(sample.accel);
  return msg;
}

ImuSample fromMsg(const vip_slam_msgs::ImuSample& msg) {
  ImuSample sample;
  sample.t = msg.t;
  sample.gyro = fromMsg(msg.gyro);
  sample.accel = fromMsg(msg.accel);
  return sample;
}

vip_slam_msgs::NavState toMsg(const NavState& state) {
  vip_slam_msgs::NavState msg;
  msg.t = state.t;
  msg.pose = toPoseMsg(state.T_W_I);
  msg.velocity = toVectorMsg(state.v_W);
  msg.bias_gyro = toVectorMsg(state.bias_gyro);
  msg.bias_accel = toVectorMsg(state.bias_accel);
  return msg;
}

NavState fromMsg(const vip_slam_msgs::NavState& msg) {
  NavState state;
  state.t = msg.t;
  state.T_W_I = fromMsg(msg.pose);
  state.v_W = fromMsg(msg.velocity);
  state.bias_gyro = fromMsg(msg.bias_gyro);
  state.bias_accel = fromMsg(msg.bias_accel);
  return state;
}

vip_slam_msgs::Feature toMsg(const Feature& feature) {
  vip_slam_msgs::Feature msg;
  msg.id = feature.id;
  msg.pixel = {feature.pixel.x(), feature.pixel.y()};
  msg.xy = {feature.xy.x(), feature.xy.y()};
  msg.pixel_sigma = feature.pixel_sigma;
  msg.depth = feature.depth;
  msg.depth_sigma = feature.depth_sigma;
  msg.angle = feature.angle;
  msg.octave = feature.octave;
  msg.age = feature.age;
  std::copy(feature.descriptor.begin(), feature.descriptor.end(), msg.descriptor.begin());
  return msg;
}

Feature fromMsg(const vip_slam_msgs::Feature& msg) {
  Feature feature;
  feature.id = msg.id;
  feature.pixel = {msg.pixel[0], msg.pixel[1]};
  feature.xy = {msg.xy[0], msg.xy[1]};
  feature.pixel_sigma = msg.pixel_sigma;
  feature.depth = msg.depth;
  feature.depth_sigma = msg.depth_sigma;
  feature.angle = msg.angle;
  feature.octave = msg.octave;
  feature.age = msg.age;
  std::copy(msg.descriptor.begin(), msg.descriptor.end(), feature.descriptor.begin());
  return feature;
}

vip_slam_msgs::DepthGrid toMsg(const DepthGrid& grid) {
  vip_slam_msgs::DepthGrid msg;
  msg.stride = grid.stride;
  msg.offset = grid.offset;
  msg.cols = grid.cols;
  msg.rows = grid.rows;
  msg.z = grid.z;
  return msg;
}

DepthGrid fromMsg(const vip_slam_msgs::DepthGrid& msg) {
  const bool sized = msg.cols >= 0 && msg.rows >= 0;
  if (!sized || (!msg.z.empty() && msg.z.size() != std::size_t(msg.cols) * std::size_t(msg.rows))) {
    throw std::invalid_argument("DepthGrid.z: " + std::to_string(msg.z.size()) + " values, expected cols x rows = " +
                                std::to_string(msg.cols) + " x " + std::to_string(msg.rows));
  }
  DepthGrid grid;
  grid.stride = msg.stride;
  grid.offset = msg.offset;
  grid.cols = msg.cols;
  grid.rows = msg.rows;
  grid.z = msg.z;
  return grid;
}

vip_slam_msgs::TrackedFrame toMsg(const TrackedFrame& frame, const std::string& odom_frame) {
  vip_slam_msgs::TrackedFrame msg;
  msg.header.stamp = toStamp(frame.t);
  msg.header.frame_id = odom_frame;
  msg.epoch = frame.epoch;
  msg.status = toMsg(frame.status);
  msg.state = toMsg(frame.state);
  Eigen::Map<Eigen::Matrix<double, 15, 15, Eigen::RowMajor>>(msg.covariance.data()) = frame.covariance;
  msg.imu_camera = toPoseMsg(frame.T_I_C);
  msg.chain_camera = toPoseMsg(frame.T_chain_C);
  msg.time_offset = frame.time_offset;
  msg.depth_correction = frame.camera_correction.offset;
  msg.depth_curve = frame.camera_correction.curve.added;
  msg.depth_scale = frame.camera_correction.scale;
  msg.bearing_correction = toArray(frame.camera_correction.bearing);
  msg.depth_shift = toArray(frame.camera_correction.shift);
  msg.features.reserve(frame.features.size());
  for (const Feature& feature : frame.features) msg.features.push_back(toMsg(feature));
  msg.depth_grid = toMsg(frame.depth_grid);
  msg.zero_velocity = frame.zero_velocity;
  msg.keyframe = frame.keyframe;
  return msg;
}

double timeOf(const vip_slam_msgs::TrackedFrame& msg) { return msg.header.stamp.toSec() - msg.clock_set; }

TrackedFrame fromMsg(const vip_slam_msgs::TrackedFrame& msg) {
  TrackedFrame frame;
  frame.t = timeOf(msg);
  frame.epoch = msg.epoch;
  frame.status = fromMsg(msg.status);
  frame.state = fromMsg(msg.state);
  frame.covariance = Eigen::Map<const Eigen::Matrix<double, 15, 15, Eigen::RowMajor>>(msg.covariance.data());
  frame.T_I_C = fromMsg(msg.imu_camera);
  frame.T_chain_C = fromMsg(msg.chain_camera);
  frame.time_offset = msg.time_offset;
  frame.camera_correction = {msg.depth_correction,
                             {msg.depth_curve},
                             bearingFromArray(msg.bearing_correction),
                             shiftFromArray(msg.depth_shift),
                             msg.depth_scale};
  frame.features.reserve(msg.features.size());
  for (const auto& feature : msg.features) frame.features.push_back(fromMsg(feature));
  frame.depth_grid = fromMsg(msg.depth_grid);
  frame.zero_velocity = msg.zero_velocity;
  frame.keyframe = msg.keyframe;
  return frame;
}

vip_slam_msgs::Keyframe toMsg(const Keyframe& keyframe, const std::string& odom_frame) {
  vip_slam_msgs::Keyframe msg;
  msg.id = keyframe.id;
  msg.frame = toMsg(keyframe.frame, odom_frame);
  msg.previous = keyframe.previous;
  msg.imu.reserve(keyframe.imu.size());
  for (const ImuSample& sample : keyframe.imu) msg.imu.push_back(toMsg(sample));
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(msg.gyro_correction.data()) = keyframe.gyro_correction;
  msg.imu_noise_scale = keyframe.imu_noise_scale.density;
  msg.gyro_walk_scale = keyframe.imu_noise_scale.gyro_walk;
  msg.accel_walk_scale = keyframe.imu_noise_scale.accel_walk;
  msg.depth_noise_white = keyframe.depth_noise.white;
  msg.depth_noise_shared = keyframe.depth_noise.shared;
  msg.motion = toPoseMsg(keyframe.motion.T_a_b);
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(msg.motion_covariance.data()) = keyframe.motion.covariance;
  return msg;
}

Keyframe fromMsg(const vip_slam_msgs::Keyframe& msg) {
  Keyframe keyframe;
  keyframe.id = msg.id;
  keyframe.frame = fromMsg(msg.frame);
  keyframe.previous = msg.previous;
  keyframe.imu.reserve(msg.imu.size());
  for (const auto& sample : msg.imu) keyframe.imu.push_back(fromMsg(sample));
  keyframe.gyro_correction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(msg.gyro_correction.data());
  keyframe.imu_noise_scale = {msg.imu_noise_scale, msg.gyro_walk_scale, msg.accel_walk_scale};
  keyframe.depth_noise = {msg.depth_noise_white, msg.depth_noise_shared};
  keyframe.motion.T_a_b = fromMsg(msg.motion);
  keyframe.motion.covariance =
      Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(msg.motion_covariance.data());
  return keyframe;
}

}  // namespace vip_slam
