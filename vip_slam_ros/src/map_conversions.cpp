// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/map_conversions.h"

#include <algorithm>
#include <stdexcept>

#include "vip_slam_ros/frame_conversions.h"
#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {
namespace {

vip_slam_msgs::LandmarkEstimate toLandmarkMsg(const LandmarkEstimate& landmark) {
  vip_slam_msgs::LandmarkEstimate msg;
  msg.id = landmark.id;
  msg.position = toPointMsg(landmark.p_W);
  msg.observations = landmark.observations;
  msg.plane = landmark.plane;
  std::copy(landmark.descriptor.begin(), landmark.descriptor.end(), msg.descriptor.begin());
  return msg;
}

LandmarkEstimate fromLandmarkMsg(const vip_slam_msgs::LandmarkEstimate& msg) {
  LandmarkEstimate landmark;
  landmark.id = msg.id;
  landmark.p_W = fromMsg(msg.position);
  landmark.observations = msg.observations;
  landmark.plane = msg.plane;
  std::copy(msg.descriptor.begin(), msg.descriptor.end(), landmark.descriptor.begin());
  return landmark;
}

std::pair<PlaneId, Plane> fromPlaneMsg(const vip_slam_msgs::PlaneCoefficients& msg) {
  Plane plane;
  // Assigned rather than normalised again, so that a round trip is bit-exact.
  plane.n = fromMsg(msg.normal);
  plane.d = msg.distance;
  if (std::abs(plane.n.norm() - 1.0) > 1e-6) {
    throw std::invalid_argument("MapUpdate: plane " + std::to_string(msg.id) + ": normal of length " +
                                std::to_string(plane.n.norm()) + ", expected 1");
  }
  return {msg.id, plane};
}

}  // namespace

vip_slam_msgs::LoopEvent toMsg(const LoopEvent& loop) {
  vip_slam_msgs::LoopEvent msg;
  msg.t = loop.t;
  msg.query = loop.query;
  msg.match = loop.match;
  msg.accepted = loop.accepted;
  msg.reason = loop.reason;
  msg.inliers = loop.inliers;
  msg.match_query = toPoseMsg(loop.T_match_query);
  return msg;
}

LoopEvent fromMsg(const vip_slam_msgs::LoopEvent& msg) {
  LoopEvent loop;
  loop.t = msg.t;
  loop.query = msg.query;
  loop.match = msg.match;
  loop.accepted = msg.accepted;
  loop.reason = msg.reason;
  loop.inliers = msg.inliers;
  loop.T_match_query = fromMsg(msg.match_query);
  return loop;
}

vip_slam_msgs::MapUpdate toMsg(const MapUpdate& update, const std::string& map_frame) {
  vip_slam_msgs::MapUpdate msg;
  msg.header.stamp = toStamp(update.t);
  msg.header.frame_id = map_frame;
  msg.revision = update.revision;
  msg.epoch = update.epoch;
  msg.map_odom = toPoseMsg(update.T_map_odom);
  msg.placed = update.placed;
  for (const auto& told : update.parts) {
    vip_slam_msgs::EpochPart p;
    p.epoch = told.epoch;
    p.part = told.part;
    msg.parts.push_back(p);
  }
  msg.newest_keyframe = update.newest_keyframe;
  msg.depth_curve = update.depth_curve.added;
  msg.disparity_error = update.disparity_error;
  msg.odometry_variance = update.odometry_variance;
  msg.global_update = update.global;
  msg.keyframes.reserve(update.keyframes.size());
  for (const auto& keyframe : update.keyframes) {
    vip_slam_msgs::KeyframeEstimate k;
    k.id = keyframe.id;
    k.state = toMsg(keyframe.state);
    k.imu_camera = toPoseMsg(keyframe.T_I_C);
    k.depth_correction = keyframe.camera_correction.offset;
    k.depth_curve = keyframe.camera_correction.curve.added;
    k.depth_scale = keyframe.camera_correction.scale;
    k.bearing_correction = toArray(keyframe.camera_correction.bearing);
    k.depth_shift = toArray(keyframe.camera_correction.shift);
    msg.keyframes.push_back(k);
  }
  msg.landmarks.reserve(update.landmarks.size());
  for (const auto& landmark : update.landmarks) msg.landmarks.push_back(toLandmarkMsg(landmark));
  for (const auto& [id, plane] : update.planes) {
    vip_slam_msgs::PlaneCoefficients p;
    p.id = id;
    p.normal = toVectorMsg(plane.n);
    p.distance = plane.d;
    msg.planes.push_back(p);
  }
  msg.removed_keyframes = update.removed_keyframes;
  msg.removed_landmarks = update.removed_landmarks;
  for (const auto& [from, into] : update.merged_landmarks) {
    vip_slam_msgs::LandmarkMerge merge;
    merge.from = from;
    merge.into = into;
    msg.merged_landmarks.push_back(merge);
  }
  for (const auto& loop : update.loops) msg.loops.push_back(toMsg(loop));
  return msg;
}

MapUpdate fromMsg(const vip_slam_msgs::MapUpdate& msg) {
  MapUpdate update;
  update.t = msg.header.stamp.toSec();
  update.revision = msg.revision;
  update.epoch = msg.epoch;
  update.T_map_odom = fromMsg(msg.map_odom);
  update.placed = msg.placed;
  for (const auto& told : msg.parts) update.parts.push_back({told.epoch, told.part});
  update.newest_keyframe = msg.newest_keyframe;
  update.depth_curve.added = msg.depth_curve;
  update.disparity_error = msg.disparity_error;
  update.odometry_variance = msg.odometry_variance;
  update.global = msg.global_update;
  update.keyframes.reserve(msg.keyframes.size());
  for (const auto& keyframe : msg.keyframes) {
    update.keyframes.push_back({keyframe.id,
                                fromMsg(keyframe.state),
                                fromMsg(keyframe.imu_camera),
                                {keyframe.depth_correction,
                                 {keyframe.depth_curve},
                                 bearingFromArray(keyframe.bearing_correction),
                                 shiftFromArray(keyframe.depth_shift),
                                 keyframe.depth_scale}});
  }
  update.landmarks.reserve(msg.landmarks.size());
  for (const auto& landmark : msg.landmarks) update.landmarks.push_back(fromLandmarkMsg(landmark));
  for (const auto& plane : msg.planes) update.planes.push_back(fromPlaneMsg(plane));
  update.removed_keyframes = msg.removed_keyframes;
  update.removed_landmarks = msg.removed_landmarks;
  for (const auto& merge : msg.merged_landmarks) update.merged_landmarks.emplace_back(merge.from, merge.into);
  for (const auto& loop : msg.loops) update.loops.push_back(fromMsg(loop));
  return update;
}

}  // namespace vip_slam
