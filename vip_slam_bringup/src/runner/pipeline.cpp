// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/runner/pipeline.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "vip_slam_ros/stream_faults.h"

namespace vip_slam {

Pipeline::Pipeline(const PipelineOptions& options, const SensorConfig& sensor, TimingLog* timing)
    : options_(options),
      front_end_(std::make_unique<FrontEnd>(options.frontend, sensor, timing, options.input.time_jump)) {
  if (options.mapping) mapping_ = std::make_unique<MappingThread>(options, sensor, timing);
}

Pipeline::~Pipeline() = default;

void Pipeline::loadMap(const std::string& path, bool localise) {
  if (!mapping_) throw std::invalid_argument(path + ": a map was given, but mapping is off, expected mapping: true");
  // Before the planes process the loaded map, since their updates would change it.
  if (localise) mapping_->localiseOnly();
  front_end_->applyMapUpdate(mapping_->loadMap(path));
}

void Pipeline::add(const SensorEvent& event) {
  if (const auto* imu = std::get_if<ImuSample>(&event)) {
    front_end_->addImu(*imu);
    newest_imu_ = std::max(newest_imu_, imu->t);
  } else if (const auto* gyro = std::get_if<GyroSample>(&event)) {
    front_end_->addGyro(gyro->t, gyro->gyro);
    newest_imu_ = std::max(newest_imu_, gyro->t);
  } else if (const auto* accel = std::get_if<AccelSample>(&event)) {
    front_end_->addAccel(accel->t, accel->accel);
    newest_imu_ = std::max(newest_imu_, accel->t);
  } else if (const auto* jump = std::get_if<TimeJump>(&event)) {
    restart(jump->seconds);
  } else if (const auto* set = std::get_if<ClockSet>(&event)) {
    machine_clock_.set(set->t, set->seconds);
  } else {
    waiting_.push_back(std::get<ImagePair>(event));
    newest_image_ = std::max(newest_image_, waiting_.back().t);
  }
  processReady();
}

double Pipeline::waitedFor(double t) const {
  return std::max(newest_image_ - t, newest_imu_ - (t + front_end_->timeOffset()));
}

void Pipeline::processReady() {
  while (!waiting_.empty() && (front_end_->ready(waiting_.front().t, waiting_.front().depth_lag) ||
                               waitedFor(waiting_.front().t) > options_.input.imu_patience)) {
    process(waiting_.front());
    waiting_.pop_front();
  }
}

void Pipeline::processRest() {
  for (const ImagePair& pair : waiting_) {
    if (front_end_->ready(pair.t)) process(pair);
  }
  waiting_.clear();
}

void Pipeline::restart(double seconds) {
  processRest();
  duration_ = duration();
  oldest_taken_ = newest_taken_ = std::numeric_limits<double>::infinity();
  newest_image_ = newest_imu_ = -1e300;
  front_end_->clockRanBack(timeRanBack(seconds));
}

void Pipeline::finish() {
  processRest();
  const auto earlier = [](const auto& a, const auto& b) { return a.t < b.t; };
  std::stable_sort(odometry_.begin(), odometry_.end(), earlier);
  std::stable_sort(chain_.begin(), chain_.end(), earlier);
  std::stable_sort(covariances_.begin(), covariances_.end(), earlier);
  std::stable_sort(realtime_.begin(), realtime_.end(), earlier);
  applyAnswers(std::numeric_limits<std::size_t>::max());
  if (mapping_) mapping_->finish();
}

void Pipeline::applyAnswers(std::size_t image) {
  while (!answers_.empty() && answers_.front().due <= image) {
    for (const MapUpdate& update : answers_.front().updates.get()) {
      front_end_->applyMapUpdate(update);
      T_map_odom_ = update.T_map_odom;
      epoch_ = update.epoch;
      placed_ = update.newest_keyframe != 0 && update.placed;
    }
    answers_.pop_front();
  }
}

void Pipeline::process(const ImagePair& pair) {
  applyAnswers(images_);
  const FrameOutput output = front_end_->process({pair.t, pair.gray, pair.depth, pair.depth_lag});
  ++images_;
  newest_taken_ = pair.t;
  if (!(oldest_taken_ <= pair.t)) oldest_taken_ = pair.t;
  const TrackedFrame& frame = *output.frame;
  status_ = frame.status;
  if (states_.empty() || states_.back().status.state != frame.status.state)
    states_.push_back({frame.t, frame.status});
  else
    ++states_.back().images;
  if (frame.status.state == TrackingState::kInitialising)
    states_.back().status.reason = frame.status.reason;  // keep the newest reason for waiting
  if (hasPose(frame.status.state) && passes_.take(frame.t)) {
    odometry_.push_back({frame.t, frame.epoch, frame.state.T_W_I});
    chain_.push_back({frame.t, frame.epoch, frame.T_chain_C, velocitySigma(frame.covariance)});
    covariances_.push_back({frame.t, poseCovariance(frame)});
    if (placed_ && epoch_ == frame.epoch) realtime_.push_back({frame.t, T_map_odom_ * frame.state.T_W_I});
  }
  if (!mapping_) return;
  if (output.keyframe) {
    answers_.push_back({images_ + std::size_t(options_.lag), mapping_->addKeyframe(output.keyframe)});
    if (options_.lag == 0) applyAnswers(images_);
  }
  mapping_->grow(output.frame);
}

}  // namespace vip_slam
