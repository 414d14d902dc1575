// SPDX-License-Identifier: BSD-3-Clause
// The front-end nodelet's /diagnostics.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <vip_slam_msgs/TrackingStatus.h>

#include "front_end_nodelet.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_ros/frame_conversions.h"
#include "vip_slam_ros/process_memory.h"
#include "vip_slam_ros/stream_faults.h"
#include "vip_slam_ros/topic_lookup.h"

namespace vip_slam {

using diagnostic_msgs::DiagnosticStatus;

namespace {

double quantileOf(const std::deque<double>& values, double q) {
  return values.empty() ? 0 : quantile(std::vector<double>(values.begin(), values.end()), q);
}

}  // namespace

std::vector<FrontEndNodelet::Input> FrontEndNodelet::inputs() const {
  std::vector<Input> all = {{color_monitor_.get(), color_source_.type()}};
  if (!sensor_.topics.depth.empty()) all.push_back({depth_monitor_.get(), depth_source_.type()});
  if (sensor_.topics.hasInertial()) all.push_back({imu_monitor_.get(), "sensor_msgs/Imu"});
  if (splitImu()) all.push_back({accel_monitor_.get(), "sensor_msgs/Imu"});
  return all;
}

void FrontEndNodelet::lookUpTopics() {
  Publishers publishers = publishersOfTopics();
  ros::master::V_TopicInfo published;
  for (const Input& input : inputs()) {
    const StreamMonitor::Report r = input.monitor->report();
    const std::vector<std::string>& nodes = publishers[r.topic];
    input.monitor->setPublishers(nodes);
    if (r.messages > 0 || r.rejected > 0) continue;
    if (published.empty() && !ros::master::getTopics(published)) return;
    std::string why = whyNoMessage(r.topic, input.type, published);
    for (const std::string& node : nodes)
      if (const std::string unreachable = whyUnreachable(node); !unreachable.empty()) why = unreachable;
    input.monitor->explainAbsence(why);
  }
}

void FrontEndNodelet::tick() {
  constexpr int kLookup = 5;  // ticks
  if (ticks_++ % kLookup == kLookup - 1) lookUpTopics();
  // A status is published only with images: before the first one, and when images stop, this is the only report why
  // there is no pose.
  bool started;
  std::string start_problem;
  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    started = shown_.counters.images > 0;
    start_problem = shown_.start_problem;
  }
  const double now = ros::Time::now().toSec();
  // A player that has not begun, or is paused at its beginning, is no fault of the topics.
  const bool clock_stands = !started && ros::Time::isSimTime() && now == last_tick_;
  last_tick_ = now;
  TrackingStatus waiting{TrackingState::kWaiting, ""};
  if (paused_) {
    waiting.reason = "paused; the service pause (false) goes on";
  } else if (clock_stands) {
    waiting.reason = "simulated time (/clock) stands still: nothing is being played";
  } else if (started) {
    waiting.reason = color_monitor_->silence(now);
  } else {
    const bool imu = sensor_.topics.hasInertial();
    // A rate that differs from the configured one does no harm by itself: it is reported last.
    waiting.reason = color_monitor_->fault(now);
    if (waiting.reason.empty() && imu) waiting.reason = imu_monitor_->fault(now);
    if (waiting.reason.empty() && splitImu()) waiting.reason = accel_monitor_->absence(now);
    if (waiting.reason.empty()) waiting.reason = calibration_->waitingFor();
    if (waiting.reason.empty()) waiting.reason = start_problem;
    if (waiting.reason.empty()) waiting.reason = color_monitor_->complaint(now);
    if (waiting.reason.empty() && imu) waiting.reason = imu_monitor_->complaint(now);
    if (waiting.reason.empty())
      waiting.reason = std::string("the first image waits for its depth") + (imu ? " and the IMU" : "");
  }
  if (!waiting.reason.empty()) {
    status_pub_.publish(toMsg(waiting));
    if (clock_stands)
      NODELET_INFO_THROTTLE(10, "WAITING: %s", waiting.reason.c_str());
    else
      NODELET_WARN_THROTTLE(10, "WAITING: %s", waiting.reason.c_str());
    std::lock_guard<std::mutex> lock(shown_mutex_);
    shown_.status = waiting;
  } else if (const std::string depth = depthAbsence(now); !depth.empty()) {
    NODELET_WARN_THROTTLE(10, "no depth, no planes: %s", depth.c_str());
  }
  for (const Input& input : inputs())
    if (const std::string rivalry = input.monitor->rivalry(now); !rivalry.empty())
      NODELET_WARN_THROTTLE(10, "topic %s: %s", input.monitor->report().topic.c_str(), rivalry.c_str());
  if (const std::string moved = calibration_->movedInTf(); !moved.empty())
    NODELET_ERROR_THROTTLE(10, "%s", moved.c_str());
  if (const std::string rival = tfRival(); !rival.empty()) NODELET_WARN_THROTTLE(10, "tf: %s", rival.c_str());
  diagnostics_->force_update();
}

std::string FrontEndNodelet::tfRival() const { return publish_tf_ ? rivals_->words(ros::WallTime::now().toSec()) : ""; }

void FrontEndNodelet::reportTf(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const std::string moved = calibration_->movedInTf(), rival = tfRival();
  status.summary(DiagnosticStatus::OK, "no other source of '" + options_.base_frame + "'");
  if (!rival.empty()) status.mergeSummary(DiagnosticStatus::WARN, rival);
  if (!moved.empty()) status.mergeSummary(DiagnosticStatus::ERROR, moved);
}

std::string FrontEndNodelet::depthAbsence(double now) const {
  if (sensor_.topics.depth.empty()) return "";
  const std::string absence = depth_monitor_->absence(now);
  constexpr int kLasting = 20;  // images; a hand in front of the camera is gone sooner
  if (!absence.empty() || empty_depth_ < kLasting) return absence;
  return "topic " + depth_monitor_->report().topic + ": images " + holdNoDepth(sensor_.depth_noise);
}

void FrontEndNodelet::reportTracking(diagnostic_updater::DiagnosticStatusWrapper& status) {
  Shown shown;
  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    shown = shown_;
  }
  const TrackingState state = shown.status.state;
  const auto level = state == TrackingState::kTracking ? DiagnosticStatus::OK
                     : state == TrackingState::kLost   ? DiagnosticStatus::ERROR
                                                       : DiagnosticStatus::WARN;
  const std::string reason = shown.status.reason.empty() ? "" : ": " + shown.status.reason;
  status.summary(level, trackingStateName(state) + reason);
  const FrontEndCounters& c = shown.counters;
  status.add("features", shown.features);
  status.add("processing of the last image (ms)", shown.processing);
  status.add("processing, median of the last minute (ms)", quantileOf(shown.recent, 0.5));
  status.add("processing, 99 % of the last minute (ms)", quantileOf(shown.recent, 0.99));
  status.add("latency, stamp to odometry (ms)", 1e3 * shown.latency);
  status.add("depth surfaces used", c.surfaces_used);
  status.add("NIS per degree of freedom", c.nis_per_dof);
  status.add("vertical by", frontend::levelName(c.level));
  status.add("pixel sigma in use", c.sigma_px);
  status.add("IMU noise in use, times the configured", c.imu_noise_scale);
  status.add("drift of the gyroscope's bias in use, times the configured random walk", c.gyro_walk);
  status.add("drift of the accelerometer's bias in use, times the configured random walk", c.accel_walk);
  status.add("depth noise that a surface shares, times the configured", c.depth_shared);
  status.add("images that contradict the IMU", c.imu_contradicted);
  status.add("camera's delay in use (ms)", 1e3 * shown.calibration.time_offset);
  status.add("extrinsics", shown.extrinsics);
  for (const std::string& difference : shown.calibration_differences) status.add("calibration", difference);
  status.add("images", c.images);
  status.add("keyframes", c.keyframes);
  status.add("restarts", c.restarts);
  status.add("times lost", c.lost);
  status.add("images on the IMU alone", c.coasting);
  status.add("images that moved by themselves", c.moving);
  status.add("images standing still", c.zero_velocity);
  status.add("landmarks of the map found again", c.landmarks_reacquired);
  status.add("memory (MB)", processMemoryMb());
}

void FrontEndNodelet::reportInput(diagnostic_updater::DiagnosticStatusWrapper& status) {
  Shown shown;
  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    shown = shown_;
  }
  const double now = ros::Time::now().toSec();
  std::string complaints;
  for (const Input& input : inputs()) {
    const std::string complaint = input.monitor->complaint(now);
    if (!complaint.empty()) complaints += (complaints.empty() ? "" : "; ") + complaint;
    const StreamMonitor::Report r = input.monitor->report();
    const std::string name = r.topic + " ";
    status.add(name + "rate (Hz)", r.rate);
    status.add(name + "delay on arrival (ms)", 1e3 * r.delay);
    status.add(name + "gaps", r.gaps);
    status.add(name + "largest gap (ms)", 1e3 * r.largest_gap);
    status.add(name + "repeated stamps", r.repeated);
    status.add(name + "backward stamps", r.backward);
    status.add(name + "unusable messages", r.rejected);
    status.add(name + "messages of another frame", r.of_other_frame);
    if (!r.last_rejection.empty()) status.add(name + "last unusable", r.last_rejection);
  }
  constexpr std::size_t kLately = 10;  // reports, one a second
  lately_paired_.push_back(shown.pairs);
  if (lately_paired_.size() > kLately) lately_paired_.pop_front();
  if (!sensor_.topics.depth.empty() && mostlyUnpaired(lately_paired_.front(), shown.pairs)) {
    const double skew = depth_monitor_->report().newest - color_monitor_->report().newest;
    complaints += (complaints.empty() ? "" : "; ") +
                  formatted(
                      "%s (%.1f Hz) and %s (%.1f Hz) are not synchronised: newest stamps %.0f ms apart, pairs "
                      "need %.0f ms",
                      color_monitor_->report().topic.c_str(), color_monitor_->report().rate,
                      depth_monitor_->report().topic.c_str(), depth_monitor_->report().rate, 1e3 * std::abs(skew),
                      1e3 * options_.input.pair_tolerance);
  }
  if (empty_depth_ > 0 && complaints.empty()) complaints = depthAbsence(now);
  if (!shown.size_problem.empty()) complaints += (complaints.empty() ? "" : "; ") + shown.size_problem;
  status.summary(complaints.empty() ? DiagnosticStatus::OK : DiagnosticStatus::WARN,
                 complaints.empty() ? "all topics arrive" : complaints);
  const FrontEndCounters& c = shown.counters;
  status.add("colour-depth pairs", shown.pairs.pairs);
  status.add("colour images without depth", shown.pairs.without_depth);
  status.add("skew of the last pair (ms)", 1e3 * shown.pairs.skew);
  status.add("images of wrong size or type", c.bad_image);
  status.add("depth of wrong size or type", c.bad_depth);
  status.add("images out of order", shown.pairs.backward + c.bad_stamp);
  status.add("messages stamped ahead", shown.ahead);
  status.add("messages from before time ran backwards", shown.stray);
  status.add("images that repeat the one before", c.repeated_image);
  status.add("depth images that repeat the one before", c.repeated_depth);
  status.add("changes of the unit of depth, followed", c.depth_unit_changes);
  status.add("gyro samples at the end of its range", c.gyro_cut_off);
  status.add("images without IMU", c.imu_missing);
  status.add("IMU samples refused", c.imu_rejected);
  status.add("IMU gaps", c.imu_gaps);
  status.add("IMU samples far off their neighbours, replaced", c.imu_spikes);
  status.add("images before which the IMU was at fault", c.imu_faults);
  status.add("times that a clock was set", shown.clock_steps);
  status.add("times that time ran backwards", shown.time_jumps);
}

void FrontEndNodelet::reportQueues(diagnostic_updater::DiagnosticStatusWrapper& status) {
  std::size_t dropped = 0;
  for (const auto& lane : owner_->lanes()) {
    status.add(lane.name + " waiting", lane.waiting);
    status.add(lane.name + " dropped", lane.dropped);
    dropped += lane.dropped;
  }
  std::lock_guard<std::mutex> lock(shown_mutex_);
  status.add("images dropped while waiting for depth or IMU", shown_.pairs.dropped);
  dropped += shown_.pairs.dropped;
  status.summary(drops_.lately(dropped, ros::WallTime::now().toSec()) ? DiagnosticStatus::WARN : DiagnosticStatus::OK,
                 dropped == 0 ? "nothing dropped" : std::to_string(dropped) + " messages dropped");
}

}  // namespace vip_slam
