// Keyframes of the map: insertion with checks, the IMU chain, removal, covisibility.
#include <algorithm>
#include <cmath>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map/map_limits.h"
#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam {
namespace {

constexpr double kMaxGyroCorrection = 0.5;  // each entry
constexpr double kSameTime = 1e-6;          // s

bool finite(const NavState& s) {
  return std::isfinite(s.t) && s.T_W_I.isFinite() && s.v_W.allFinite() && s.bias_gyro.allFinite() &&
         s.bias_accel.allFinite();
}

std::shared_ptr<const Preintegration> integrate(const std::shared_ptr<const std::vector<ImuSample>>& imu,
                                                const Eigen::Matrix3d& gyro_correction, const NavState& from,
                                                const ImuNoise& noise, double noise_scale) {
  if (!imu || imu->size() < 2) return nullptr;
  ImuNoise scaled = noise;
  for (double* density :
       {&scaled.gyro_noise_density, &scaled.gyro_random_walk, &scaled.accel_noise_density, &scaled.accel_random_walk})
    *density *= noise_scale;
  return std::make_shared<Preintegration>(withGyroCorrection(*imu, gyro_correction), from.bias_gyro, from.bias_accel,
                                          scaled);
}

/// Whether samples tell the whole motion since `before`, the samples of the previous keyframe (null: none).
bool tellMotion(const std::vector<ImuSample>& imu, const std::vector<ImuSample>* before) {
  if (imu.size() < 2 || (before && imu.front().t > before->back().t + kSameTime)) return false;
  const auto gap = [](const ImuSample& a, const ImuSample& b) { return b.t - a.t > map_limits::kLongestImuStep; };
  return std::adjacent_find(imu.begin(), imu.end(), gap) == imu.end();
}

}  // namespace

std::string validateKeyframe(const Keyframe& keyframe) {
  const std::string name = "keyframe " + std::to_string(keyframe.id) + ": ";
  if (keyframe.id == 0) return "keyframe without an id (0)";
  if (!std::isfinite(keyframe.frame.t)) return name + "stamp is not finite";
  if (!finite(keyframe.frame.state)) return name + "state is not finite";
  if (!keyframe.frame.T_I_C.isFinite()) return name + "extrinsics are not finite";
  if (!keyframe.frame.T_chain_C.isFinite()) return name + "chained pose is not finite";
  if (!std::isfinite(keyframe.frame.time_offset)) return name + "the camera's delay is not finite";
  const DepthGrid& grid = keyframe.frame.depth_grid;
  if (!grid.empty() && grid.stride <= 0) return name + "depth grid without a stride";
  const auto& features = keyframe.frame.features;
  for (std::size_t k = 0; k < features.size(); ++k) {
    const Feature& f = features[k];
    if (!f.pixel.allFinite() || !f.xy.allFinite() || !std::isfinite(f.depth) || !std::isfinite(f.depth_sigma) ||
        !std::isfinite(f.pixel_sigma) || !std::isfinite(f.angle))
      return name + "feature " + std::to_string(k) + " is not finite";
    if (f.depth < 0 || (f.depth > 0 && !(f.depth_sigma > 0)))
      return name + "feature " + std::to_string(k) + " has depth " + std::to_string(f.depth) + " with sigma " +
             std::to_string(f.depth_sigma);
  }
  for (std::size_t k = 0; k < keyframe.imu.size(); ++k) {
    const ImuSample& s = keyframe.imu[k];
    if (!std::isfinite(s.t) || !s.gyro.allFinite() || !s.accel.allFinite())
      return name + "IMU sample " + std::to_string(k) + " is not finite";
    if (k > 0 && !(s.t > keyframe.imu[k - 1].t))
      return name + "IMU sample " + std::to_string(k) + " is not after the one before";
    if (s.gyro.norm() > map_limits::kMaxRate || s.accel.norm() > map_limits::kMaxAcceleration)
      return name + "IMU sample " + std::to_string(k) + " is out of any sensor's range";
  }
  if (!keyframe.imu.empty() && keyframe.imu.back().t - keyframe.imu.front().t > map_limits::kLongestImu)
    return name + "its IMU samples span hours";
  // The newest keyframe's camera correction is applied to all keyframes.
  const std::string camera = validateCameraCorrection(keyframe.frame.camera_correction);
  if (!camera.empty()) return name + "the camera's correction: " + camera;
  if (!keyframe.gyro_correction.allFinite() || keyframe.gyro_correction.cwiseAbs().maxCoeff() > kMaxGyroCorrection)
    return name + "the gyro's correction is not finite, or beyond what a gyro can be off by";
  if (!(keyframe.imu_noise_scale > 0 && keyframe.imu_noise_scale <= map_limits::kMaxNoiseScale))
    return name + "the scale of the IMU's noise is " + std::to_string(keyframe.imu_noise_scale);
  if (keyframe.motion.known() && !keyframe.motion.isUsable())
    return name + "the odometry's motion is not finite, or its covariance is none";
  return "";
}

MapKeyframe& Map::addKeyframe(const KeyframePtr& data, const NavState& state, const ImuNoise& noise) {
  if (!data) throw MapError("no keyframe given");
  const std::string name = "keyframe " + std::to_string(data->id);
  if (data->id <= newestKeyframe())
    throw MapError(name + " is not newer than keyframe " + std::to_string(newestKeyframe()) + " of the map");
  if (!keyframes_.empty() && data->id - keyframes_.begin()->first > map_limits::kWidestIds)
    throw MapError(name + " is too far from the first one, " + std::to_string(keyframes_.begin()->first));
  const std::string bad = validateKeyframe(*data);
  if (!bad.empty()) throw MapError(bad);
  if (!finite(state)) throw MapError(name + ": state in the map is not finite");
  KeyframeId previous = 0;
  std::shared_ptr<const std::vector<ImuSample>> imu;
  if (data->previous != 0 && !keyframes_.empty()) {
    // The front end's previous keyframe may have been refused or culled: then the chain is cut here.
    const auto it = keyframes_.find(data->previous);
    if (it != keyframes_.end() && it->second.next == 0 && it->second.data->frame.epoch == data->frame.epoch) {
      if (!(data->frame.t > it->second.data->frame.t))
        throw MapError(name + ": stamp is not after that of its previous keyframe " + std::to_string(data->previous));
      previous = data->previous;
      const auto& before = it->second.imu;
      if (before && !data->imu.empty() && data->imu.front().t < before->back().t - kSameTime)
        throw MapError(name + ": its IMU samples begin before those of its previous keyframe end");
      if (tellMotion(data->imu, before.get())) imu = std::shared_ptr<const std::vector<ImuSample>>(data, &data->imu);
    }
  }
  try {
    return insert(data, state, previous, imu, noise);
  } catch (const std::invalid_argument& e) {  // numbers in range that cannot be integrated together
    throw MapError(name + ": IMU samples: " + e.what());
  }
}

MapKeyframe& Map::restoreKeyframe(const KeyframePtr& data, const NavState& state, KeyframeId previous,
                                  const std::vector<ImuSample>& imu, const ImuNoise& noise) {
  if (!data) throw MapError("no keyframe given");
  const std::string name = "keyframe " + std::to_string(data->id);
  if (hasKeyframe(data->id)) throw MapError(name + " exists already");
  const std::string bad = validateKeyframe(*data);
  if (!bad.empty()) throw MapError(bad);
  if (!finite(state)) throw MapError(name + ": state in the map is not finite");
  if (previous != 0 && (!hasKeyframe(previous) || keyframe(previous).next != 0))
    throw MapError(name + ": its previous keyframe " + std::to_string(previous) + " is missing or has a successor");
  std::shared_ptr<const std::vector<ImuSample>> samples;
  if (previous != 0 && imu.size() >= 2) samples = std::make_shared<const std::vector<ImuSample>>(imu);
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
    kf.preintegration = integrate(imu, kf.gyro_correction, keyframe(previous).state, noise, kf.imu_noise_scale);
  }
  MapKeyframe& inserted = keyframes_.emplace(data->id, std::move(kf)).first->second;
  if (previous != 0) keyframe(previous).next = data->id;
  return inserted;
}

void Map::adoptExtrinsics(const SE3& T_I_C) {
  for (auto& [id, kf] : keyframes_) {
    if (kf.stored || kf.T_I_C.matrix() == T_I_C.matrix()) continue;
    const SE3 T_now_then = T_I_C * kf.T_I_C.inverse();
    kf.state.T_W_I = kf.state.T_W_I * T_now_then.inverse();
    kf.motion.T_a_b = T_now_then * kf.motion.T_a_b * T_now_then.inverse();
    kf.T_I_C = T_I_C;
  }
}

void Map::adoptCameraCorrection(const CameraCorrection& correction) {
  for (auto& [id, kf] : keyframes_) {
    if (kf.stored || kf.data->frame.camera_correction == correction) continue;
    const KeyframePtr corrected = withCameraCorrection(kf.data, correction);
    // IMU samples inside the keyframe's data must not keep the old data alive.
    if (kf.imu && kf.imu.get() == &kf.data->imu) kf.imu = {corrected, &corrected->imu};
    kf.data = corrected;
    for (auto& entry : kf.planes) setCameraCorrection(correction, &entry.second);
  }
}

void Map::adoptGyroCorrection(const Eigen::Matrix3d& correction, const ImuNoise& noise) {
  std::vector<KeyframeId> others;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  for (auto& [id, kf] : keyframes_) {
    if (kf.stored || kf.gyro_correction == correction) continue;
    // The corrected rate of a body at rest must stay zero.
    kf.state.bias_gyro = (I + correction) * (I + kf.gyro_correction).inverse() * kf.state.bias_gyro;
    kf.gyro_correction = correction;
    others.push_back(id);
  }
  for (const KeyframeId id : others) {
    MapKeyframe& kf = keyframe(id);
    if (kf.preintegration)
      kf.preintegration = integrate(kf.imu, correction, keyframe(kf.previous).state, noise, kf.imu_noise_scale);
  }
}

void Map::removeKeyframe(KeyframeId id, const ImuNoise& noise, double max_imu_seconds) {
  MapKeyframe& kf = keyframe(id);
  for (const LandmarkId landmark : std::vector<LandmarkId>(kf.landmarks))
    if (landmark != kNoLandmark) removeObservation(landmark, id);
  const KeyframeId previous = kf.previous, next = kf.next;
  if (next != 0) {
    MapKeyframe& n = keyframe(next);
    std::shared_ptr<const std::vector<ImuSample>> joined;
    std::shared_ptr<const Preintegration> preintegration;
    KeyframeId chained = 0;
    if (previous != 0 && kf.imu && n.imu && n.imu->back().t - kf.imu->front().t <= max_imu_seconds) {
      auto samples = std::make_shared<std::vector<ImuSample>>(*kf.imu);
      samples->insert(samples->end(), n.imu->begin() + 1, n.imu->end());
      joined = samples;
      const double scale = std::max(kf.imu_noise_scale, n.imu_noise_scale);
      preintegration = integrate(joined, n.gyro_correction, keyframe(previous).state, noise, scale);
      n.imu_noise_scale = scale;
      chained = previous;
    }
    n.motion = chained ? compose(kf.motion, n.motion) : RelativeMotion();
    n.previous = chained;
    n.imu = joined;
    n.preintegration = preintegration;
    if (previous != 0) keyframe(previous).next = chained ? next : 0;
  } else if (previous != 0) {
    keyframe(previous).next = 0;
  }
  keyframes_.erase(id);
  if (aliases_.crowded()) forgetAliases();
  changes_.removed_keyframes.push_back(id);
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
  if (!finite(state)) throw MapError("keyframe " + std::to_string(id) + ": new state is not finite");
  MapKeyframe& kf = keyframe(id);
  kf.state = state;
  if (kf.next == 0) return;
  MapKeyframe& next = keyframe(kf.next);
  if (next.preintegration && next.preintegration->needsReintegration(state.bias_gyro, state.bias_accel))
    next.preintegration = integrate(next.imu, next.gyro_correction, state, noise, next.imu_noise_scale);
}

void Map::widenImuNoise(KeyframeId id, double factor, const ImuNoise& noise) {
  MapKeyframe& kf = keyframe(id);
  kf.imu_noise_scale = std::min(factor * kf.imu_noise_scale, map_limits::kMaxNoiseScale);
  if (kf.preintegration)
    kf.preintegration = integrate(kf.imu, kf.gyro_correction, keyframe(kf.previous).state, noise, kf.imu_noise_scale);
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
