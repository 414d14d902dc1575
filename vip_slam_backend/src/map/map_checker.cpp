#include "vip_slam_backend/map/map_checker.h"

#include <cmath>

namespace vip_slam {
namespace {

std::string checkKeyframe(const Map& map, KeyframeId id, const MapKeyframe& kf) {
  const std::string name = "keyframe " + std::to_string(id) + ": ";
  if (!kf.data || kf.data->id != id) return name + "its data carry another id";
  if (kf.landmarks.size() != kf.features().size()) return name + "landmark links and features differ in number";
  if (!kf.state.T_W_I.isFinite() || !kf.state.v_W.allFinite() || !kf.state.bias_gyro.allFinite() ||
      !kf.state.bias_accel.allFinite())
    return name + "state is not finite";
  if (kf.previous != 0) {
    if (!map.hasKeyframe(kf.previous)) return name + "its previous keyframe is not in the map";
    if (map.keyframe(kf.previous).next != id) return name + "its previous keyframe does not link back";
    if (kf.preintegration && !(kf.preintegration->dt() > 0)) return name + "its IMU factor has no duration";
    if (kf.motion.known() && !kf.motion.isUsable()) return name + "the odometry's motion is unusable";
  } else if (kf.preintegration || kf.imu || kf.motion.known()) {
    return name + "an IMU factor or a motion without a previous keyframe";
  }
  if (kf.next != 0) {
    if (!map.hasKeyframe(kf.next)) return name + "its next keyframe is not in the map";
    if (map.keyframe(kf.next).previous != id) return name + "its next keyframe does not link back";
  }
  for (std::size_t f = 0; f < kf.landmarks.size(); ++f) {
    if (kf.landmarks[f] == kNoLandmark) continue;
    const MapLandmark* landmark = map.findLandmark(kf.landmarks[f]);
    if (!landmark) return name + "feature " + std::to_string(f) + " points to a landmark that is gone";
    bool linked = false;
    for (const MapObservation& o : landmark->observations) linked |= o.keyframe == id && o.feature == f;
    if (!linked) return name + "feature " + std::to_string(f) + " is unknown to its landmark";
  }
  for (const auto& entry : kf.planes) {
    if (!map.hasPlane(entry.first)) return name + "observes plane " + std::to_string(entry.first) + " that is gone";
    if (entry.second.plane != entry.first || entry.second.keyframe != id)
      return name + "a plane observation of another";
    if (!entry.second.G.allFinite()) return name + "a plane observation is not finite";
  }
  return "";
}

std::string checkLandmark(const Map& map, LandmarkId id, const MapLandmark& landmark) {
  const std::string name = "landmark " + std::to_string(id) + ": ";
  if (landmark.id != id) return name + "carries another id";
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

}  // namespace

std::string checkMap(const Map& map) {
  for (const auto& entry : map.keyframes()) {
    const std::string bad = checkKeyframe(map, entry.first, entry.second);
    if (!bad.empty()) return bad;
  }
  for (const LandmarkId id : map.landmarkIds()) {
    const std::string bad = checkLandmark(map, id, map.landmark(id));
    if (!bad.empty()) return bad;
  }
  for (const auto& entry : map.planes()) {
    const Plane& plane = entry.second.estimate.plane;
    if (entry.second.estimate.id != entry.first) return "plane " + std::to_string(entry.first) + ": carries another id";
    if (!plane.n.allFinite() || !std::isfinite(plane.d) || std::abs(plane.n.norm() - 1.0) > 1e-6)
      return "plane " + std::to_string(entry.first) + ": not a unit normal and a finite distance";
  }
  return "";
}

}  // namespace vip_slam
