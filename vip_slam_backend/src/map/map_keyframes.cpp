// SPDX-License-Identifier: BSD-3-Clause
// Keyframes of the map: insertion with checks, the IMU chain, removal, covisibility.
#include <algorithm>
#include <cmath>

#include "map_validation.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map/map_limits.h"
#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam {
namespace {

using ImuSamples = std::shared_ptr<const std::vector<ImuSample>>;

/// IMU factor into keyframe `id`. Throws MapError when numbers in range cannot be integrated together.
std::shared_ptr<const Preintegration> integrate(KeyframeId id, const ImuSamples& imu,
                                                const Eigen::Matrix3d& gyro_correction, const NavState& from,
                                                const ImuNoise& noise, const ImuNoiseScale& noise_scale) {
  if (!imu) return nullptr;
  const std::string name = "keyframe " + std::to_string(id) + ": IMU samples: ";
  try {
    const auto factor = std::make_shared<Preintegration>(withGyroCorrection(*imu, gyro_correction), from.bias_gyro,
                                                         from.bias_accel, scaled(noise, noise_scale));
    if (!isFinite(*factor)) throw MapError(name + "their integral is not finite");
    return factor;
  } catch (const std::invalid_argument& e) {
    throw MapError(name + e.what());
  }
}

/// Whether samples tell the whole motion into `data` since `before`.
bool tellMotion(const std::vector<ImuSample>& imu, const MapKeyframe& before, const Keyframe& data) {
  if (imu.size() < 2 || !agreeInDuration(imu, before.data->frame, data.frame)) return false;
  if (before.imu && !continues(imu, *before.imu)) return false;
  const auto gap = [](const ImuSample& a, const ImuSample& b) { return b.t - a.t > map_limits::kLongestImuStep; };
  return std::adjacent_find(imu.begin(), imu.end(), gap) == imu.end();
}

}  // namespace

MapKeyframe& Map::addKeyframe(const KeyframePtr& data, const NavState& state, const ImuNoise& noise) {
  if (!data) throw MapError("no keyframe given");
  const std::string name = "keyframe " + std::to_string(data->id);
  if (data->id <= newestKeyframe())
    throw MapError(name + " is not newer than keyframe " + std::to_string(newestKeyframe()) + " of the map");
  if (!keyframes_.empty() && data->id - keyframes_.begin()->first > map_limits::kWidestIds)
    throw MapError(name + " is too far from the first one, " + std::to_string(keyframes_.begin()->first));
  const std::string bad = validateKeyframe(*data);
  if (!bad.empty()) throw MapError(bad);
  if (!isFinite(state)) throw MapError(name + ": state in the map is not finite");
  KeyframeId previous = 0;
  ImuSamples imu;
  if (data->previous != 0 && !keyframes_.empty()) {
    // The front end's previous keyframe may have been refused or culled: then the chain is cut here.
    const auto it = keyframes_.find(data->previous);
    if (it != keyframes_.end() && it->second.next == 0 && it->second.data->frame.epoch == data->frame.epoch) {
      if (!(data->frame.t > it->second.data->frame.t))
        throw MapError(name + ": stamp is not after that of its previous keyframe " + std::to_string(data->previous));
      previous = data->previous;
      const auto& before = it->second.imu;
      if (before && !data->imu.empty() && data->imu.front().t < before->back().t - map_limits::kRounding)
        throw MapError(name + ": its IMU samples begin before those of its previous keyframe end");
      if (tellMotion(data->imu, it->second, *data)) imu = ImuSamples(data, &data->imu);
    }
  }
  return insert(data, state, previous, imu, noise);
}

MapKeyframe& Map::restoreKeyframe(const KeyframePtr& data, const NavState& state, KeyframeId previous,
                                  const std::vector<ImuSample>& imu, const ImuNoise& noise) {
  if (!data) throw MapError("no keyframe given");
  const std::string name = "keyframe " + std::to_string(data->id);
  if (hasKeyframe(data->id)) throw MapError(name + " exists already");
  const std::string bad = validateKeyframe(*data);
  if (!bad.empty()) throw MapError(bad);
  if (!isFinite(state)) throw MapError(name + ": state in the map is not finite");
  if (previous != 0 && (!hasKeyframe(previous) || keyframe(previous).next != 0))
    throw MapError(name + ": its previous keyframe " + std::to_string(previous) + " is missing or has a successor");
  if (const std::string wrong = validateImu(imu); !wrong.empty()) throw MapError(name + ": " + wrong);
  ImuSamples samples;
  if (previous != 0) {
    const MapKeyframe& before = keyframe(previous);
    if (before.data->frame.epoch != data->frame.epoch || !(data->frame.t > before.data->frame.t))
      throw MapError(name + ": its previous keyframe " + std::to_string(previous) +
                     " is of another odometry, or not before it");
    if (tellMotion(imu, before, *data)) samples = std::make_shared<const std::vector<ImuSample>>(imu);
  }
  MapKeyframe& restored = insert(data, state, previous, samples, noise);
  restored.stored = true;
  return restored;
}

MapKeyframe& Map::insert(const KeyframePtr& data, const NavState& state, KeyframeId previous,
                         const std::shared_ptr<const std::vector<ImuSample>>& imu, const ImuNoise& noise) {
  MapKeyframe kf;
  kf.data = data;
  kf.state = state;
  kf.T_I_C = data->frame.T_I_C;
  kf.landmarks.assign(data->frame.features.size(), kNoLandmark);
  kf.previous = previous;
  kf.gyro_correction = data->gyro_correction;
  kf.imu_noise_scale = data->imu_noise_scale;
  if (previous != 0) {
    kf.motion = data->motion;
    kf.imu = imu;
    kf.preintegration =
        integrate(data->id, imu, kf.gyro_correction, keyframe(previous).state, noise, kf.imu_noise_scale);
  }
  MapKeyframe& inserted = keyframes_.emplace(data->id, std::move(kf)).first->second;
  if (previous != 0) keyframe(previous).next = data->id;
  return inserted;
}

void Map::adoptExtrinsics(const SE3& T_I_C) {
  if (!T_I_C.isFinite()) throw MapError("new extrinsics are not finite");
  for (auto& [id, kf] : keyframes_) {
    if (kf.stored || kf.T_I_C.matrix() == T_I_C.matrix()) continue;
    const SE3 T_now_then = T_I_C * kf.T_I_C.inverse();
    kf.state.T_W_I = kf.state.T_W_I * T_now_then.inverse();
    kf.motion.T_a_b = T_now_then * kf.motion.T_a_b * T_now_then.inverse();
    kf.T_I_C = T_I_C;
  }
}

void Map::adoptCameraCorrection(const CameraCorrection& correction) {
  const std::string bad = validateCameraCorrection(correction);
  if (!bad.empty()) throw MapError("new correction of the camera: " + bad);
  for (auto& [id, kf] : keyframes_) {
    if (kf.stored || kf.data->frame.camera_correction == correction) continue;
    kf.motion = withDepthScale(kf.motion, correction.scale / kf.data->frame.camera_correction.scale);
    const KeyframePtr corrected = withCameraCorrection(kf.data, correction);
    // IMU samples inside the keyframe's data must not keep the old data alive.
    if (kf.imu && kf.imu.get() == &kf.data->imu) kf.imu = {corrected, &corrected->imu};
    kf.data = corrected;
    for (auto& entry : kf.planes) setCameraCorrection(correction, &entry.second);
  }
}

void Map::adoptGyroCorrection(const Eigen::Matrix3d& correction, const ImuNoise& noise) {
  if (!isGyroCorrection(correction))
    throw MapError("new correction of the gyro is not finite, or beyond what a gyro can be off by");
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  std::map<KeyframeId, NavState> states;  // with the biases of the corrected rates
  for (const auto& [id, kf] : keyframes_) {
    if (kf.stored || kf.gyro_correction == correction) continue;
    // The corrected rate of a body at rest must stay zero.
    states[id] = kf.state;
    states[id].bias_gyro = (I + correction) * (I + kf.gyro_correction).inverse() * kf.state.bias_gyro;
    if (!isFinite(states[id])) throw MapError("keyframe " + std::to_string(id) + ": corrected state is not finite");
  }
  std::map<KeyframeId, std::shared_ptr<const Preintegration>> factors;
  for (const auto& [id, kf] : keyframes_) {
    if (!kf.preintegration) continue;
    const auto from = states.find(kf.previous);
    const NavState& before = from != states.end() ? from->second : keyframe(kf.previous).state;
    const bool corrected = states.count(id) != 0;
    if (corrected || kf.preintegration->needsReintegration(before.bias_gyro, before.bias_accel))
      factors[id] =
          integrate(id, kf.imu, corrected ? correction : kf.gyro_correction, before, noise, kf.imu_noise_scale);
  }
  for (const auto& [id, state] : states) {
    keyframe(id).state = state;
    keyframe(id).gyro_correction = correction;
  }
  for (auto& [id, factor] : factors) keyframe(id).preintegration = std::move(factor);
}

void Map::removeKeyframe(KeyframeId id, const ImuNoise& noise, double max_imu_seconds) {
  MapKeyframe& kf = keyframe(id);
  if (kf.next != 0)
    joinOver(kf, noise, max_imu_seconds);
  else if (kf.previous != 0)
    keyframe(kf.previous).next = 0;
  for (const LandmarkId landmark : std::vector<LandmarkId>(kf.landmarks))
    if (landmark != kNoLandmark) removeObservation(landmark, id);
  keyframes_.erase(id);
  if (aliases_.crowded()) forgetAliases();
  changes_.removed_keyframes.push_back(id);
}

bool Map::joinable(const MapKeyframe& kf) const {
  if (kf.previous == 0 || kf.next == 0) return false;
  const MapKeyframe& next = keyframe(kf.next);
  if (kf.imu && next.imu) return true;
  return !kf.imu && !next.imu && kf.motion.known() && next.motion.known();
}

double Map::joinedSeconds(const MapKeyframe& kf) const {
  const MapKeyframe& next = keyframe(kf.next);
  if (kf.imu) return next.imu->back().t - kf.imu->front().t;
  return next.data->frame.t - keyframe(kf.previous).data->frame.t;
}

void Map::joinOver(const MapKeyframe& kf, const ImuNoise& noise, double max_imu_seconds) {
  MapKeyframe& next = keyframe(kf.next);
  ImuSamples joined;
  std::shared_ptr<const Preintegration> preintegration;
  ImuNoiseScale scale = next.imu_noise_scale;
  bool chain = joinable(kf) && joinedSeconds(kf) <= max_imu_seconds;
  if (chain && kf.imu) {
    auto samples = std::make_shared<std::vector<ImuSample>>(*kf.imu);
    samples->insert(samples->end(), next.imu->begin() + 1, next.imu->end());
    chain = agreeInDuration(*samples, keyframe(kf.previous).data->frame, next.data->frame);
    if (chain) {
      joined = samples;
      const ImuNoiseScale& first = kf.imu_noise_scale;
      scale = {std::max(first.density, scale.density), std::max(first.gyro_walk, scale.gyro_walk),
               std::max(first.accel_walk, scale.accel_walk)};
      preintegration = integrate(next.id(), joined, next.gyro_correction, keyframe(kf.previous).state, noise, scale);
    }
  }
  const KeyframeId chained = chain ? kf.previous : 0;
  if (kf.previous != 0) keyframe(kf.previous).next = chained ? kf.next : 0;
  next.motion = chained ? compose(kf.motion, next.motion) : RelativeMotion();
  next.previous = chained;
  next.imu = joined;
  next.preintegration = preintegration;
  next.imu_noise_scale = scale;
}

MapKeyframe& Map::keyframe(KeyframeId id) {
  const auto it = keyframes_.find(id);
  if (it == keyframes_.end()) throw MapError("no keyframe " + std::to_string(id) + " in the map");
  return it->second;
}

const MapKeyframe& Map::keyframe(KeyframeId id) const { return const_cast<Map*>(this)->keyframe(id); }

std::vector<std::pair<KeyframeId, int>> Map::covisible(KeyframeId id, int min_shared) const {
  std::map<KeyframeId, int> count;
  for (const LandmarkId landmark_id : keyframe(id).landmarks) {
    if (landmark_id == kNoLandmark) continue;
    for (const MapObservation& o : landmark(landmark_id).observations)
      if (o.keyframe != id) ++count[o.keyframe];
  }
  std::vector<std::pair<KeyframeId, int>> result;
  for (const auto& c : count)
    if (c.second >= min_shared) result.push_back(c);
  std::sort(result.begin(), result.end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first > b.first;
  });
  return result;
}

void Map::setState(KeyframeId id, const NavState& state, const ImuNoise& noise) {
  if (!isFinite(state)) throw MapError("keyframe " + std::to_string(id) + ": new state is not finite");
  MapKeyframe& kf = keyframe(id);
  if (kf.next != 0) {
    MapKeyframe& next = keyframe(kf.next);
    if (next.preintegration && next.preintegration->needsReintegration(state.bias_gyro, state.bias_accel))
      next.preintegration = integrate(kf.next, next.imu, next.gyro_correction, state, noise, next.imu_noise_scale);
  }
  kf.state = state;
}

void Map::widenImuNoise(KeyframeId id, double factor, const ImuNoise& noise) {
  MapKeyframe& kf = keyframe(id);
  ImuNoiseScale scale = kf.imu_noise_scale;
  scale.density = std::min(factor * scale.density, map_limits::kLargest);
  if (!isImuNoiseScale(scale))
    throw MapError("keyframe " + std::to_string(id) + ": factor on the IMU's noise is " + std::to_string(factor));
  if (kf.preintegration)
    kf.preintegration = integrate(id, kf.imu, kf.gyro_correction, keyframe(kf.previous).state, noise, scale);
  kf.imu_noise_scale = scale;
}

void Map::widenMotion(KeyframeId id, double factor) {
  MapKeyframe& kf = keyframe(id);
  if (!(factor > 0) || !std::isfinite(factor))
    throw MapError("keyframe " + std::to_string(id) + ": factor on the odometry's covariance is " +
                   std::to_string(factor));
  kf.motion.covariance *= factor;
}

void Map::moveKeyframes(const std::map<KeyframeId, SE3>& T_W_I) {
  std::map<KeyframeId, SE3> motion;  // new world from old world, per keyframe
  for (const auto& entry : T_W_I) {
    if (!entry.second.isFinite())
      throw MapError("keyframe " + std::to_string(entry.first) + ": new pose is not finite");
    motion[entry.first] = entry.second * keyframe(entry.first).state.T_W_I.inverse();
  }
  for (auto& entry : landmarks_) {
    MapLandmark& landmark = entry.second;
    const auto it = motion.find(landmark.host());
    if (it != motion.end()) landmark.p_W = it->second * landmark.p_W;
  }
  for (const auto& entry : T_W_I) {
    NavState& state = keyframe(entry.first).state;
    state.v_W = motion[entry.first].rotation() * state.v_W;
    state.T_W_I = entry.second;
  }
}

MapChanges Map::takeChanges() {
  MapChanges taken;
  std::swap(taken, changes_);
  return taken;
}

void Map::clear() { *this = Map(); }

}  // namespace vip_slam
