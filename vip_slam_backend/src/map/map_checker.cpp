// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/map/map_checker.h"

#include <algorithm>
#include <cmath>

#include "map_validation.h"
#include "vip_slam_backend/map/map_limits.h"

namespace vip_slam {
namespace {

std::string checkEstimate(const MapKeyframe& kf) {
  if (kf.landmarks.size() != kf.features().size()) return "landmark links and features differ in number";
  if (!isFinite(kf.state)) return "state in the map is not finite";
  if (!kf.T_I_C.isFinite()) return "extrinsics in the map are not finite";
  if (!isGyroCorrection(kf.gyro_correction)) return "the gyro's correction in the map is none";
  if (!isImuNoiseScale(kf.imu_noise_scale)) return "the scale of the IMU's noise in the map is none";
  return "";
}

std::string checkChain(const Map& map, KeyframeId id, const MapKeyframe& kf) {
  if (kf.next != 0) {
    if (!map.hasKeyframe(kf.next)) return "its next keyframe is not in the map";
    if (map.keyframe(kf.next).previous != id) return "its next keyframe does not link back";
  }
  if (kf.previous == 0)
    return kf.preintegration || kf.imu || kf.motion.known() ? "an IMU factor or a motion without a previous keyframe"
                                                            : "";
  if (!map.hasKeyframe(kf.previous)) return "its previous keyframe is not in the map";
  const MapKeyframe& previous = map.keyframe(kf.previous);
  if (previous.next != id) return "its previous keyframe does not link back";
  if (previous.data->frame.epoch != kf.data->frame.epoch) return "its previous keyframe is of another odometry";
  if (!(kf.data->frame.t > previous.data->frame.t)) return "its stamp is not after that of its previous keyframe";
  if (kf.motion.known() && !kf.motion.isUsable()) return "the odometry's motion is unusable";
  return "";
}

/// What is wrong with the IMU factor into a keyframe.
std::string checkImu(const MapKeyframe& previous, const MapKeyframe& kf) {
  if (!kf.imu != !kf.preintegration) return "IMU samples without a factor, or a factor without samples";
  if (!kf.imu) return "";
  if (kf.imu->size() < 2) return "an IMU factor of a single sample";
  if (const std::string bad = validateImu(*kf.imu); !bad.empty()) return bad;
  const Preintegration& factor = *kf.preintegration;
  if (!isFinite(factor)) return "its IMU factor is not finite";
  if (std::abs(factor.dt() - (kf.imu->back().t - kf.imu->front().t)) > map_limits::kRounding)
    return "its IMU factor lasts longer or shorter than the samples";
  if (!agreeInDuration(*kf.imu, previous.data->frame, kf.data->frame))
    return "its IMU samples last longer or shorter than its stamps say";
  if (previous.imu && !continues(*kf.imu, *previous.imu))
    return "its IMU samples do not begin where those of its previous keyframe end";
  if (factor.needsReintegration(previous.state.bias_gyro, previous.state.bias_accel))
    return "its IMU factor was integrated with other biases";
  return "";
}

std::string checkFeatures(const Map& map, KeyframeId id, const MapKeyframe& kf) {
  for (std::size_t f = 0; f < kf.landmarks.size(); ++f) {
    if (kf.landmarks[f] == kNoLandmark) continue;
    const MapLandmark* landmark = map.findLandmark(kf.landmarks[f]);
    if (!landmark) return "feature " + std::to_string(f) + " points to a landmark that is gone";
    const auto& all = landmark->observations;
    const auto own = std::lower_bound(
        all.begin(), all.end(), id, [](const MapObservation& o, KeyframeId keyframe) { return o.keyframe < keyframe; });
    if (own == all.end() || own->keyframe != id || own->feature != f)
      return "feature " + std::to_string(f) + " is unknown to its landmark";
  }
  return "";
}

std::string checkPlanes(const Map& map, KeyframeId id, const MapKeyframe& kf) {
  for (const auto& [plane, seen] : kf.planes) {
    if (!map.hasPlane(plane)) return "observes plane " + std::to_string(plane) + " that is gone";
    if (seen.plane != plane || seen.keyframe != id) return "a plane observation of another";
    if (seen.points.empty()) return "a plane observation without points";
    if (const std::string bad = validateObservation(seen); !bad.empty()) return bad;
    if (seen.camera_correction != kf.data->frame.camera_correction)
      return "a plane observation with another correction of the camera";
  }
  return "";
}

std::string checkKeyframe(const Map& map, KeyframeId id, const MapKeyframe& kf) {
  if (const std::string bad = validateKeyframe(*kf.data); !bad.empty()) return bad;
  std::string bad = checkEstimate(kf);
  if (bad.empty()) bad = checkChain(map, id, kf);
  if (bad.empty() && kf.previous != 0) bad = checkImu(map.keyframe(kf.previous), kf);
  if (bad.empty()) bad = checkFeatures(map, id, kf);
  if (bad.empty()) bad = checkPlanes(map, id, kf);
  return bad.empty() ? "" : "keyframe " + std::to_string(id) + ": " + bad;
}

std::string checkLandmark(const Map& map, LandmarkId id, const MapLandmark& landmark) {
  const std::string name = "landmark " + std::to_string(id) + ": ";
  if (id == kNoLandmark || landmark.id != id) return name + "carries no or another id";
  if (!landmark.p_W.allFinite()) return name + "position is not finite";
  if (landmark.observations.empty()) return name + "no observation";
  if (landmark.plane != 0 && !map.hasPlane(landmark.plane)) return name + "lies on a plane that is gone";
  if (map.resolve(id) != id) return name + "was merged into another but is still here";
  KeyframeId last = 0;
  for (const MapObservation& o : landmark.observations) {
    if (o.keyframe <= last) return name + "observations are not ascending, one per keyframe";
    last = o.keyframe;
    if (!map.hasKeyframe(o.keyframe)) return name + "seen by a keyframe that is gone";
    const MapKeyframe& kf = map.keyframe(o.keyframe);
    if (o.feature >= kf.landmarks.size() || kf.landmarks[o.feature] != id)
      return name + "keyframe " + std::to_string(o.keyframe) + " does not link back";
  }
  return "";
}

std::string checkPlane(PlaneId id, const PlaneEstimate& estimate) {
  const std::string name = "plane " + std::to_string(id) + ": ";
  if (id == 0 || estimate.id != id) return name + "carries no or another id";
  const Plane& plane = estimate.plane;
  if (!plane.n.allFinite() || !std::isfinite(plane.d) || std::abs(plane.n.norm() - 1.0) > map_limits::kRounding)
    return name + "not a unit normal and a finite distance";
  if (!isAreaFinite(estimate)) return name + "its area or outline is not finite";
  return "";
}

}  // namespace

std::string checkMap(const Map& map) {
  for (const auto& [id, kf] : map.keyframes())
    if (!kf.data || kf.data->id != id) return "keyframe " + std::to_string(id) + ": its data carry another id";
  for (const auto& [id, plane] : map.planes())
    if (const std::string bad = checkPlane(id, plane.estimate); !bad.empty()) return bad;
  // Before the keyframes' links are looked up in them.
  for (const auto& [id, landmark] : map.landmarks())
    if (const std::string bad = checkLandmark(map, id, landmark); !bad.empty()) return bad;
  for (const auto& [id, kf] : map.keyframes())
    if (const std::string bad = checkKeyframe(map, id, kf); !bad.empty()) return bad;
  return "";
}

}  // namespace vip_slam
