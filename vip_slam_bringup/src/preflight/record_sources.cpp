// SPDX-License-Identifier: BSD-3-Clause
// Recordings from a bag and from live topics.
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <topic_tools/shape_shifter.h>

#include "vip_slam_bringup/preflight/recorder.h"

namespace vip_slam {
namespace {

/// `source`: a rosbag::MessageInstance or a ShapeShifter, which both have a type and instantiate messages.
template <class Source>
void dispatch(Recorder* recorder, const std::string& topic, double arrival, const Source& source) {
  const std::string type = source.getDataType();
  if (type == "sensor_msgs/Image") {
    if (const auto m = source.template instantiate<sensor_msgs::Image>()) recorder->add(topic, arrival, *m, m);
  } else if (type == "sensor_msgs/CompressedImage") {
    if (const auto m = source.template instantiate<sensor_msgs::CompressedImage>()) recorder->add(topic, arrival, *m);
  } else if (type == "sensor_msgs/CameraInfo") {
    if (const auto m = source.template instantiate<sensor_msgs::CameraInfo>()) recorder->add(topic, arrival, *m);
  } else if (type == "sensor_msgs/Imu") {
    if (const auto m = source.template instantiate<sensor_msgs::Imu>()) recorder->add(topic, arrival, *m);
  } else if (type == "tf2_msgs/TFMessage" || type == "tf/tfMessage") {
    if (const auto m = source.template instantiate<tf2_msgs::TFMessage>()) recorder->add(*m);
  }
}

std::vector<std::string> topicsOf(const SensorConfig& sensor) {
  const SensorTopics& t = sensor.topics;
  std::vector<std::string> out{"/tf", "/tf_static"};
  for (const std::string& topic : {t.color, t.color_info, t.depth, t.depth_info, t.imu, t.gyro, t.accel})
    if (!topic.empty()) out.push_back(topic);
  return out;
}

}  // namespace

Recording recordBag(const BagSet& bags, const SensorConfig& sensor, double image_seconds) {
  try {
    Recorder recorder(sensor, false, image_seconds);
    std::map<std::string, std::string> topics;
    for (const rosbag::ConnectionInfo* connection : bags.view()->getConnections())
      topics[connection->topic] = connection->datatype;
    recorder.setTopics(topics);
    const auto view = bags.view(topicsOf(sensor));
    for (const rosbag::MessageInstance& message : *view)
      dispatch(&recorder, message.getTopic(), message.getTime().toSec(), message);
    recorder.finish();
    return recorder.recording();
  } catch (const ros::Exception& e) {
    throw std::runtime_error(bags.name() + ": the bag breaks off: " + e.what() + "; rosbag reindex may mend it");
  }
}

Recording recordLive(const SensorConfig& sensor, double seconds) {
  if (!ros::master::check())
    throw std::runtime_error("no ROS master at " + ros::master::getURI() +
                             "; is roscore running, is ROS_MASTER_URI right?");
  ros::NodeHandle nh;
  Recorder recorder(sensor, true, seconds);
  std::vector<ros::Subscriber> subscribers;
  for (const std::string& topic : topicsOf(sensor)) {
    // When it came, not when its turn comes here: decoding the images may lag behind on a busy machine.
    const boost::function<void(const ros::MessageEvent<const topic_tools::ShapeShifter>&)> take =
        [&recorder, topic](const ros::MessageEvent<const topic_tools::ShapeShifter>& event) {
          dispatch(&recorder, topic, event.getReceiptTime().toSec(), *event.getConstMessage());
        };
    subscribers.push_back(
        nh.subscribe<topic_tools::ShapeShifter, const ros::MessageEvent<const topic_tools::ShapeShifter>&>(topic, 400,
                                                                                                           take));
  }
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(seconds);
  while (ros::ok() && ros::WallTime::now() < end) ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
  std::map<std::string, std::string> topics;
  ros::master::V_TopicInfo infos;
  ros::master::getTopics(infos);
  for (const auto& info : infos) topics[info.name] = info.datatype;
  recorder.setTopics(topics);
  recorder.finish();
  return recorder.recording();
}

}  // namespace vip_slam
