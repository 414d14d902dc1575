// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/runner/bag_extrinsics.h"

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include "vip_slam_ros/tf_lookup.h"

namespace vip_slam {
namespace {

std::string firstFrame(const BagSet& bags, const std::string& topic, const ros::Time& begin) {
  const auto view = bags.view({topic}, begin);
  for (const auto& message : *view) {
    if (const auto image = message.instantiate<sensor_msgs::Image>()) return image->header.frame_id;
    if (const auto image = message.instantiate<sensor_msgs::CompressedImage>()) return image->header.frame_id;
    if (const auto imu = message.instantiate<sensor_msgs::Imu>()) return imu->header.frame_id;
    break;
  }
  return "";
}

void addAll(rosbag::View& view, bool are_static, tf2::BufferCore* tf) {
  for (const auto& message : view) {
    const auto transforms = message.instantiate<tf2_msgs::TFMessage>();
    if (!transforms) continue;
    for (const auto& transform : transforms->transforms) tf->setTransform(transform, "bag", are_static);
  }
}

}  // namespace

BagExtrinsics extrinsicsInBag(const BagSet& bags, const SensorTopics& topics, const ros::Time& begin, double patience) {
  BagExtrinsics out;
  out.camera_frame = firstFrame(bags, topics.color, begin);
  out.imu_frame = firstFrame(bags, topics.inertial(), begin);
  tf2::BufferCore tf;
  addAll(*bags.view({"/tf"}, begin, begin + ros::Duration(patience)), false, &tf);
  addAll(*bags.view({"/tf_static"}), true, &tf);
  out.T_imu_cam = lookUpExtrinsics(tf, out.imu_frame, out.camera_frame);
  return out;
}

}  // namespace vip_slam
