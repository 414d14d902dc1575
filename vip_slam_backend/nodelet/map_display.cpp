// SPDX-License-Identifier: BSD-3-Clause
#include "map_display.h"

#include <algorithm>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/markers.h"
#include "vip_slam_ros/point_cloud.h"

namespace vip_slam {

using visualization_msgs::Marker;

void MapDisplay::addKeyframe(const Keyframe& keyframe) {
  stamps_[keyframe.id] = keyframe.frame.t;
  T_imu_cam_ = keyframe.frame.T_I_C;
}

void MapDisplay::apply(const MapUpdate& update) {
  for (const auto& keyframe : update.keyframes) {
    const auto stamp = stamps_.find(keyframe.id);
    keyframes_[keyframe.id] = {stamp == stamps_.end() ? keyframe.state.t : stamp->second, keyframe.state.T_W_I};
  }
  for (const auto& landmark : update.landmarks) landmarks_[landmark.id] = {landmark.p_W.cast<float>(), landmark.plane};
  for (const KeyframeId id : update.removed_keyframes) {
    keyframes_.erase(id);
    stamps_.erase(id);
  }
  for (const LandmarkId id : update.removed_landmarks) landmarks_.erase(id);
  for (const auto& [from, into] : update.merged_landmarks) landmarks_.erase(from);
  if (update.global) planes_.clear();
  for (const auto& plane : update.planes) planes_.insert(plane.first);
  for (const LoopEvent& loop : update.loops)
    if (loop.accepted) loops_.emplace_back(loop.query, loop.match);
}

void MapDisplay::clear() {
  stamps_.clear();
  keyframes_.clear();
  landmarks_.clear();
  loops_.clear();
  planes_.clear();
}

std::size_t MapDisplay::planeLandmarkCount() const {
  return std::size_t(std::count_if(landmarks_.begin(), landmarks_.end(),
                                   [](const auto& landmark) { return landmark.second.plane != 0; }));
}

nav_msgs::Path MapDisplay::path(const std_msgs::Header& header) const {
  nav_msgs::Path path;
  path.header = header;
  path.poses.reserve(keyframes_.size());
  for (const auto& [id, keyframe] : keyframes_) {
    geometry_msgs::PoseStamped pose;
    pose.header.frame_id = header.frame_id;
    pose.header.stamp = toStamp(keyframe.t);
    pose.pose = toPoseMsg(keyframe.T_map_I * T_imu_base_);
    path.poses.push_back(pose);
  }
  return path;
}

visualization_msgs::MarkerArray MapDisplay::markers(const std_msgs::Header& header) const {
  Marker line = makeMarker(header, "trajectory", 0, Marker::LINE_STRIP);
  line.scale.x = 0.03;
  line.color = makeColor(0.1, 0.75, 0.35);
  Marker frusta = makeMarker(header, "keyframes", 0, Marker::LINE_LIST);
  frusta.scale.x = 0.01;
  frusta.color = makeColor(0.2, 0.45, 0.9, 0.8);
  // A small pyramid: apex at the camera, base in front of it.
  const double w = 0.08, h = 0.06, d = 0.1;
  const Eigen::Vector3d corners[4] = {{-w, -h, d}, {w, -h, d}, {w, h, d}, {-w, h, d}};
  for (const auto& [id, keyframe] : keyframes_) {
    line.points.push_back(toPointMsg(keyframe.T_map_I.t()));
    const SE3 T_map_cam = keyframe.T_map_I * T_imu_cam_;
    for (int i = 0; i < 4; ++i) {
      const auto here = toPointMsg(T_map_cam * corners[i]);
      frusta.points.push_back(toPointMsg(T_map_cam.t()));
      frusta.points.push_back(here);
      frusta.points.push_back(here);
      frusta.points.push_back(toPointMsg(T_map_cam * corners[(i + 1) % 4]));
    }
  }
  Marker edges = makeMarker(header, "loops", 0, Marker::LINE_LIST);
  edges.scale.x = 0.04;
  edges.color = makeColor(0.95, 0.25, 0.2);
  for (const auto& loop : loops_) {
    const auto query = keyframes_.find(loop.first), match = keyframes_.find(loop.second);
    if (query == keyframes_.end() || match == keyframes_.end()) continue;
    edges.points.push_back(toPointMsg(query->second.T_map_I.t()));
    edges.points.push_back(toPointMsg(match->second.T_map_I.t()));
  }
  visualization_msgs::MarkerArray array;
  for (const Marker& marker : {line, frusta, edges}) {
    // rviz rejects lines of fewer than two points; delete the old marker instead.
    const bool drawable = marker.points.size() >= 2;
    array.markers.push_back(drawable ? marker : makeDeletion(header, marker.ns, marker.id));
  }
  return array;
}

sensor_msgs::PointCloud2 MapDisplay::landmarks(const std_msgs::Header& header) const {
  ColoredCloud points;
  points.reserve(landmarks_.size());
  const auto grey = makeColor(0.75, 0.75, 0.75);
  for (const auto& [id, landmark] : landmarks_)
    addPoint(landmark.p, landmark.plane == 0 ? grey : colorOfId(landmark.plane), &points);
  return toPointCloud(points, header);
}

}  // namespace vip_slam
