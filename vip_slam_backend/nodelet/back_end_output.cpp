// SPDX-License-Identifier: BSD-3-Clause
// What the back-end nodelet publishes: map updates, display, statistics and diagnostics.
#include <vip_slam_msgs/LoopEvent.h>
#include <vip_slam_msgs/MapUpdate.h>

#include "back_end_nodelet.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/map_conversions.h"
#include "vip_slam_ros/process_memory.h"

namespace vip_slam {

using diagnostic_msgs::DiagnosticStatus;

void BackEndNodelet::distribute(const MapUpdate& update) {
  pose_.apply(update);
  display_.apply(update);
  map_update_pub_.publish(boost::make_shared<vip_slam_msgs::MapUpdate>(toMsg(update, options_.map_frame)));
  for (const LoopEvent& loop : update.loops)
    loop_pub_.publish(boost::make_shared<vip_slam_msgs::LoopEvent>(toMsg(loop)));
  publishDisplay(update.t, update.global);

  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    shown_.header.stamp = toStamp(update.t);
    shown_.revision = update.revision;
    for (const LoopEvent& loop : update.loops) ++(loop.accepted ? shown_.loops_accepted : shown_.loops_rejected);
  }
  publishStatistics();
}

void BackEndNodelet::publishStatistics() {
  auto statistics = boost::make_shared<vip_slam_msgs::BackEndStatistics>();
  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    shown_.keyframes = std::uint32_t(display_.keyframeCount());
    shown_.landmarks = std::uint32_t(display_.landmarkCount());
    shown_.plane_landmarks = std::uint32_t(display_.planeLandmarkCount());
    shown_.planes = std::uint32_t(display_.planeCount());
    shown_.keyframes_dropped = owner_->lanes()[keyframe_lane_].dropped;
    *statistics = shown_;
  }
  statistics_pub_.publish(statistics);
}

void BackEndNodelet::publishDisplay(double t, bool now) {
  if (!now && t > last_display_ && t - last_display_ < 1.0 / display_rate_) return;
  last_display_ = t;
  std_msgs::Header header;
  header.stamp = toStamp(t);
  header.frame_id = options_.map_frame;
  path_pub_.publish(boost::make_shared<nav_msgs::Path>(display_.path(header)));
  if (markers_pub_.getNumSubscribers() > 0) {
    markers_pub_.publish(boost::make_shared<visualization_msgs::MarkerArray>(display_.markers(header)));
  }
  if (landmarks_pub_.getNumSubscribers() > 0) {
    landmarks_pub_.publish(boost::make_shared<sensor_msgs::PointCloud2>(display_.landmarks(header)));
  }
}

void BackEndNodelet::report(diagnostic_updater::DiagnosticStatusWrapper& status) {
  std::size_t dropped = 0;
  for (const auto& lane : owner_->lanes()) {
    status.add(lane.name + " waiting", lane.waiting);
    status.add(lane.name + " dropped", lane.dropped);
    dropped += lane.dropped;
  }
  std::lock_guard<std::mutex> lock(shown_mutex_);
  if (!load_problem_.empty()) {
    status.summary(DiagnosticStatus::ERROR, load_problem_);
  } else if (!problem_.empty()) {
    status.summary(DiagnosticStatus::WARN, problem_);
  } else if (refusals_.lately(refused_, ros::WallTime::now().toSec())) {
    status.summary(DiagnosticStatus::WARN, "refused: " + last_refusal_);
  } else if (drops_.lately(dropped, ros::WallTime::now().toSec())) {
    status.summary(DiagnosticStatus::WARN, std::to_string(dropped) + " messages dropped: the back end is too slow");
  } else {
    status.summary(DiagnosticStatus::OK,
                   std::to_string(shown_.keyframes) + " keyframes, " + std::to_string(shown_.landmarks) + " landmarks");
  }
  for (const std::string& difference : calibration_differences_) {
    if (!difference.empty()) status.add("calibration", difference);
  }
  status.add("keyframes", shown_.keyframes);
  status.add("landmarks", shown_.landmarks);
  status.add("landmarks on planes", shown_.plane_landmarks);
  status.add("planes", shown_.planes);
  status.add("loops accepted", shown_.loops_accepted);
  status.add("loops rejected", shown_.loops_rejected);
  status.add("refused", refused_);
  if (refused_ > 0) status.add("last refused", last_refusal_);
  status.add("last keyframe (ms)", shown_.local_ms);
  status.add("last global adjustment (ms)", shown_.global_ms);
  status.add("global adjustments", shown_.global_adjustments);
  status.add("localisation mode", shown_.localisation_mode ? "on" : "off");
  status.add("memory (MB)", processMemoryMb());
}

}  // namespace vip_slam
