// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/runner/mapping_thread.h"

#include <optional>
#include <utility>

namespace vip_slam {
namespace {

constexpr std::size_t kWaiting = 256;

BackEndOptions lockStep(BackEndOptions options) {
  options.lockstep = true;
  return options;
}

}  // namespace

MappingThread::MappingThread(const PipelineOptions& options, const SensorConfig& sensor, TimingLog* timing)
    : timing_(timing),
      back_end_(std::make_unique<BackEnd>(lockStep(options.backend), sensor, timing)),
      work_(kWaiting) {
  if (variantFromName(options.backend.variant) != Variant::kVi) {
    planes_ = std::make_unique<PlaneMapper>(options.planes, makeCamera(sensor.camera), sensor.depth_noise, timing);
  }
  thread_ = std::thread([this] {
    while (const auto work = work_.pop()) {
      try {
        (*work)();
      } catch (...) {
        if (!failure_) failure_ = std::current_exception();
      }
    }
  });
}

MappingThread::~MappingThread() {
  work_.close();
  if (thread_.joinable()) thread_.join();
}

MapUpdate MappingThread::loadMap(const std::string& path) {
  const MapUpdate update = back_end_->loadMap(path);
  if (planes_) {
    planes_->restore(back_end_->storedPlanes(), update.newest_keyframe);
    back_end_->applyPlaneUpdate(planes_->applyMapUpdate(update));
  }
  return update;
}

void MappingThread::grow(TrackedFramePtr frame) {
  if (!planes_) return;
  work_.push([this, frame = std::move(frame)] {
    if (placed_ && frame->epoch == epoch_) planes_->grow(*frame, T_map_odom_);
  });
}

std::future<std::vector<MapUpdate>> MappingThread::addKeyframe(KeyframePtr keyframe) {
  auto task = std::make_shared<std::packaged_task<std::vector<MapUpdate>()>>(
      [this, keyframe = std::move(keyframe)] { return process(keyframe); });
  auto result = task->get_future();
  work_.push([task] { (*task)(); });
  return result;
}

std::vector<MapUpdate> MappingThread::process(const KeyframePtr& keyframe) {
  ScopedTimer timer(timing_, "mapping.keyframe", keyframe->frame.t);
  std::vector<MapUpdate> updates;
  if (planes_) planes_->addKeyframe(keyframe);
  updates.push_back(back_end_->addKeyframe(keyframe));
  distribute(updates.back());
  if (back_end_->globalBaWanted()) {
    ScopedTimer adjustment(timing_, "mapping.global_ba", keyframe->frame.t);
    const GbaJob job = back_end_->startGlobalBa();
    updates.push_back(back_end_->merge(back_end_->run(job)));
    distribute(updates.back());
    adjustments_.push_back({keyframe->frame.t, updates.back().keyframes.size(), adjustment.milliseconds()});
  }
  return updates;
}

void MappingThread::distribute(const MapUpdate& update) {
  T_map_odom_ = update.T_map_odom;
  epoch_ = update.epoch;
  placed_ = update.newest_keyframe != 0;
  if (planes_) {
    back_end_->applyPlaneUpdate(planes_->applyMapUpdate(update));
    for (const PlaneEstimate& estimate : planes_->planes()) {
      plane_history_.push_back({update.t, estimate.id, estimate.plane});
    }
  }
  for (const std::string& reason : back_end_->takeRefusals()) warnings_.push_back("refused: " + reason);
  for (const std::string& notice : back_end_->takeNotices()) warnings_.push_back(notice);
}

void MappingThread::finish() {
  work_.push([this] {
    const double t = back_end_->snapshot().keyframes.empty() ? 0 : back_end_->snapshot().keyframes.back().t;
    ScopedTimer timer(timing_, "mapping.finish", t);
    // With their planes, which the last adjustment then uses.
    if (const std::optional<MapUpdate> waited = back_end_->mapWaiting()) distribute(*waited);
    const MapUpdate update = back_end_->finish();
    distribute(update);
    if (update.global) adjustments_.push_back({t, update.keyframes.size(), timer.milliseconds()});
  });
  work_.close();
  if (thread_.joinable()) thread_.join();
  if (failure_) std::rethrow_exception(failure_);
}

std::vector<PlaneEstimate> MappingThread::planes() const {
  return planes_ ? planes_->planes() : std::vector<PlaneEstimate>();
}

}  // namespace vip_slam
