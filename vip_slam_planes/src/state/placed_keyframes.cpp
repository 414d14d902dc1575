// SPDX-License-Identifier: BSD-3-Clause
#include "placed_keyframes.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam {

bool isSound(const KeyframeEstimate& estimate) {
  return estimate.state.T_W_I.isFinite() && estimate.T_I_C.isFinite() &&
         validateCameraCorrection(estimate.camera_correction).empty();
}

std::size_t PlacedKeyframes::wait(const KeyframePtr& keyframe) {
  waiting_.emplace(keyframe->id, keyframe);
  // One more than the back end holds: the newest one, which it may still place.
  std::size_t forgotten = 0;
  for (; waiting_.size() > kMaxWaitingKeyframes + 1; ++forgotten) waiting_.erase(waiting_.begin());
  return forgotten;
}

KeyframePtr PlacedKeyframes::place(const KeyframeEstimate& estimate, double same_place) {
  const auto it = waiting_.find(estimate.id);
  if (it == waiting_.end() || !isSound(estimate)) return nullptr;
  const KeyframePtr keyframe = withCameraCorrection(it->second, estimate.camera_correction);
  waiting_.erase(it);
  placed_[keyframe->id] = keyframe;
  const RelativeMotion& motion = keyframe->motion;
  if (motion.known() && motion.covariance.bottomRightCorner<3, 3>().trace() > same_place * same_place) {
    const Eigen::Matrix3d R = (estimate.state.T_W_I.rotation() * motion.T_a_b.rotation().inverse()).matrix();
    const Eigen::Matrix3d covariance = R * motion.covariance.bottomRightCorner<3, 3>() * R.transpose();
    unsure_.push_back({keyframe->id, covariance / (same_place * same_place)});
    std::sort(unsure_.begin(), unsure_.end(), [](const auto& a, const auto& b) { return a.to < b.to; });
  }
  poses_[keyframe->id] = estimate.state.T_W_I * estimate.T_I_C;
  if (keyframe->id > newest_) newest_ = keyframe->id, epoch_ = keyframe->frame.epoch;
  epoch_of_[keyframe->id] = keyframe->frame.epoch;
  epochs_.add(keyframe->frame.epoch);
  return keyframe;
}

KeyframeId PlacedKeyframes::sureSince(const Eigen::Vector3d& normal) const {
  const auto last = std::find_if(unsure_.rbegin(), unsure_.rend(),
                                 [&normal](const auto& motion) { return normal.dot(motion.covariance * normal) > 1; });
  return last == unsure_.rend() ? 0 : last->to;
}

PlaneViews PlacedKeyframes::views() const {
  const auto newest = placed_.find(newest_);
  return {placed_, poses_, noise_, newest == placed_.end() ? DepthNoiseParts() : newest->second->depth_noise};
}

bool PlacedKeyframes::tie(const MapUpdate& update) {
  const auto closed = [&update](const UnsureMotion& motion) {
    return std::any_of(update.loops.begin(), update.loops.end(), [&motion](const LoopEvent& loop) {
      const auto [first, last] = std::minmax(loop.query, loop.match);
      return loop.accepted && first < motion.to && last >= motion.to;
    });
  };
  const auto kept = std::remove_if(unsure_.begin(), unsure_.end(), closed);
  const bool across = kept != unsure_.end();
  unsure_.erase(kept, unsure_.end());
  return epochs_.tie(update.parts) || across;
}

void PlacedKeyframes::addHost(const PlaneHost& host) {
  epochs_.add(host.epoch);
  if (host.keyframe != 0) poses_[host.keyframe] = host.T_map_C, epoch_of_[host.keyframe] = host.epoch;
}

const CameraPoses& PlacedKeyframes::posesTiedTo(std::uint32_t epoch) {
  if (epochs_.allTied()) return poses_;
  tied_poses_.clear();
  for (const auto& [id, keyframe] : placed_) {
    if (epochs_.tied(keyframe->frame.epoch, epoch)) tied_poses_[id] = poses_.at(id);
  }
  return tied_poses_;
}

// Until the body has moved, the gravity direction may be wrong by a degree, so that horizontal and vertical surfaces
// lean in the map.
double PlacedKeyframes::gravitySigma() const {
  const auto newest = placed_.find(newest_);
  if (newest == placed_.end()) return 0;
  const TrackedFrame& frame = newest->second->frame;
  const Eigen::Matrix3d R = frame.state.T_W_I.R();
  const Eigen::Matrix3d covariance = R * frame.covariance.topLeftCorner<3, 3>() * R.transpose();
  const double variance = covariance.diagonal().head<2>().maxCoeff();
  return std::isfinite(variance) ? std::sqrt(std::max(0.0, variance)) : 0.0;
}

void PlacedKeyframes::stopWaiting(const std::set<KeyframeId>& named, KeyframeId newest) {
  for (auto it = waiting_.begin(); it != waiting_.end() && it->first <= newest;) {
    it = named.count(it->first) ? std::next(it) : waiting_.erase(it);
  }
}

std::vector<KeyframeId> PlacedKeyframes::unnamed(const std::set<KeyframeId>& named) const {
  std::vector<KeyframeId> gone;
  for (const auto& [id, epoch] : epoch_of_) {
    if (!named.count(id)) gone.push_back(id);
  }
  return gone;
}

KeyframeId PlacedKeyframes::heirOf(KeyframeId id) const {
  const auto it = epoch_of_.find(id);
  const auto moves_alike = [&](const auto& other) { return epochs_.tied(other.second, it->second); };
  if (it != epoch_of_.begin() && moves_alike(*std::prev(it))) return std::prev(it)->first;
  if (std::next(it) != epoch_of_.end() && moves_alike(*std::next(it))) return std::next(it)->first;
  return 0;
}

KeyframePtr PlacedKeyframes::remove(KeyframeId id) {
  epoch_of_.erase(id);
  poses_.erase(id);
  const auto it = placed_.find(id);
  if (it == placed_.end()) return nullptr;
  const KeyframePtr keyframe = it->second;
  placed_.erase(it);
  if (newest_ == id) {
    newest_ = placed_.empty() ? 0 : placed_.rbegin()->first;
    if (newest_ != 0) epoch_ = placed_.rbegin()->second->frame.epoch;
  }
  return keyframe;
}

std::unordered_set<LandmarkId> PlacedKeyframes::tracks() const {
  std::unordered_set<LandmarkId> ids;
  for (const auto* keyframes : {&placed_, &waiting_}) {
    for (const auto& [id, keyframe] : *keyframes) {
      for (const Feature& f : keyframe->frame.features) ids.insert(f.id);
    }
  }
  return ids;
}

}  // namespace vip_slam
