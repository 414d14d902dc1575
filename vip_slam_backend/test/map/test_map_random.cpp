// SPDX-License-Identifier: BSD-3-Clause
// Random sequences of operations: the map is consistent after each, and what it holds can be saved and loaded again.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "map/map_fixture.h"
#include "vip_slam_backend/map/culling.h"

using namespace vip_slam;

namespace {

class RandomMap {
 public:
  explicit RandomMap(unsigned seed) : random_(seed), world_(seed, 120) {
    for (int k = 0; k < 4; ++k) addKeyframe();
  }

  using Operation = bool (RandomMap::*)();  ///< false: nothing to do, or refused
  static const std::vector<std::pair<std::string, Operation>>& operations() {
    static const std::vector<std::pair<std::string, Operation>> all = {
        {"add keyframe", &RandomMap::addKeyframe},
        {"restore keyframe", &RandomMap::restoreKeyframe},
        {"remove keyframe", &RandomMap::removeKeyframe},
        {"cull", &RandomMap::cull},
        {"add landmark", &RandomMap::addLandmark},
        {"restore landmark", &RandomMap::restoreLandmark},
        {"remove landmark", &RandomMap::removeLandmark},
        {"add observation", &RandomMap::addObservation},
        {"remove observation", &RandomMap::removeObservation},
        {"merge landmarks", &RandomMap::mergeLandmarks},
        {"set position", &RandomMap::setPosition},
        {"associate", &RandomMap::associate},
        {"set plane", &RandomMap::setPlane},
        {"set plane parameters", &RandomMap::setPlaneParameters},
        {"move plane", &RandomMap::movePlane},
        {"merge planes", &RandomMap::mergePlanes},
        {"remove plane", &RandomMap::removePlane},
        {"observe planes", &RandomMap::observePlanes},
        {"set state", &RandomMap::setState},
        {"move keyframes", &RandomMap::moveKeyframes},
        {"adopt extrinsics", &RandomMap::adoptExtrinsics},
        {"adopt camera correction", &RandomMap::adoptCameraCorrection},
        {"adopt gyro correction", &RandomMap::adoptGyroCorrection},
        {"widen IMU noise", &RandomMap::widenImuNoise},
    };
    return all;
  }

  const Map& map() const { return map_; }
  std::size_t below(std::size_t count) { return random_() % count; }

 private:
  bool chance(unsigned one_in) { return random_() % one_in == 0; }
  double within(double limit) { return std::uniform_real_distribution<double>(-limit, limit)(random_); }
  Eigen::Vector3d vector(double limit) { return {within(limit), within(limit), within(limit)}; }
  SE3 motion(double angle, double distance) { return SE3(expQuaternion(vector(angle)), vector(distance)); }

  KeyframeId anyKeyframe() { return std::next(map_.keyframes().begin(), below(map_.keyframes().size()))->first; }
  LandmarkId anyLandmark() {
    const std::vector<LandmarkId> ids = map_.landmarkIds();
    return ids.empty() ? kNoLandmark : ids[below(ids.size())];
  }
  PlaneId anyPlane() {
    return map_.planes().empty() ? 0 : std::next(map_.planes().begin(), below(map_.planes().size()))->first;
  }
  MapObservation anyFeature() {
    const KeyframeId id = anyKeyframe();
    const std::size_t features = map_.keyframe(id).landmarks.size();
    return {id, static_cast<std::uint32_t>(below(std::max<std::size_t>(features, 1)))};
  }
  bool isFree(const MapObservation& o) const {
    const std::vector<LandmarkId>& links = map_.keyframe(o.keyframe).landmarks;
    return o.feature < links.size() && links[o.feature] == kNoLandmark;
  }

  /// As published after all sorts of events: odometry begun anew, IMU with a hole or without, another delay.
  std::shared_ptr<Keyframe> publish() {
    auto kf = std::make_shared<Keyframe>(*world_.next());
    if (chance(8)) ++epoch_, kf->previous = 0;
    kf->frame.epoch = epoch_;
    if (chance(10)) kf->imu.clear();
    if (kf->imu.size() > 10 && chance(10)) kf->imu.erase(kf->imu.begin() + 5, kf->imu.end() - 5);
    if (chance(10)) kf->frame.t += 0.12;
    if (chance(10)) kf->motion = RelativeMotion();
    if (chance(10)) kf->frame.features.clear();
    if (chance(5)) kf->imu_noise_scale.density = 3;
    if (kf->frame.t <= last_stamp_) kf->frame.t = last_stamp_ + 0.01;
    last_stamp_ = kf->frame.t;
    return kf;
  }

  bool addKeyframe() {
    const auto kf = publish();
    map_.addKeyframe(kf, world_.truth(kf->frame.t), noise_);
    if (!chance(4)) maker_.process(kf->id, &map_);
    return true;
  }
  bool restoreKeyframe() {
    const auto kf = publish();
    const KeyframeId before = map_.newestKeyframe();
    const bool chained =
        before != 0 && map_.keyframe(before).next == 0 && map_.keyframe(before).data->frame.epoch == epoch_;
    map_.restoreKeyframe(kf, world_.truth(kf->frame.t), chained ? before : 0, kf->imu, noise_);
    return true;
  }
  bool removeKeyframe() {
    if (map_.keyframes().size() < 3) return false;
    map_.removeKeyframe(anyKeyframe(), noise_, chance(3) ? 0.5 : 10.0);
    return true;
  }
  bool cull() {
    CullingOptions options;
    options.redundancy = 0.2;
    options.above_keyframes = 6;
    const int landmarks = chance(4) ? cullLandmarks(map_.newestKeyframe(), &map_) : 0;
    return landmarks + !cullKeyframes(options, 4, noise_, {}, &map_).empty() > 0;
  }

  bool addLandmark() {
    const MapObservation first = anyFeature();
    if (!isFree(first)) return false;
    map_.addLandmark(next_landmark_++, vector(4), first);
    return true;
  }
  bool restoreLandmark() {
    MapLandmark stored;
    stored.id = next_landmark_++;
    stored.p_W = vector(4);
    stored.plane = chance(2) ? anyPlane() : 0;
    for (const auto& [id, kf] : map_.keyframes())
      if (const MapObservation seen{id, std::uint32_t(below(kf.landmarks.size() + 1))}; isFree(seen))
        stored.observations.push_back(seen);
    if (stored.observations.empty()) return false;
    map_.restoreLandmark(stored);
    return true;
  }
  bool removeLandmark() {
    const LandmarkId id = anyLandmark();
    if (id == kNoLandmark) return false;
    map_.removeLandmark(id);
    return true;
  }
  bool addObservation() {
    const LandmarkId id = anyLandmark();
    const MapObservation seen = anyFeature();
    return id != kNoLandmark && isFree(seen) && map_.addObservation(id, seen);
  }
  bool removeObservation() {
    const LandmarkId id = anyLandmark();
    if (id == kNoLandmark) return false;
    const auto& all = map_.landmark(id).observations;
    map_.removeObservation(id, all[below(all.size())].keyframe);
    return true;
  }
  bool mergeLandmarks() {
    const LandmarkId from = anyLandmark(), into = anyLandmark();
    return from != kNoLandmark && map_.mergeLandmarks(from, into);
  }
  bool setPosition() {
    const LandmarkId id = anyLandmark();
    if (id == kNoLandmark) return false;
    map_.setPosition(id, vector(4));
    return true;
  }
  bool associate() {
    const LandmarkId id = anyLandmark();
    if (id == kNoLandmark) return false;
    map_.associate(id, anyPlane());
    return true;
  }

  bool setPlane() {
    PlaneEstimate estimate;
    estimate.id = 1 + below(8);
    estimate.plane = Plane(Eigen::Vector3d(1, 0, 0) + vector(0.5), within(4));
    estimate.polygons = {{{vector(1), vector(1), vector(1)}, {}}};
    map_.setPlane(estimate);
    return true;
  }
  bool setPlaneParameters() {
    const PlaneId id = anyPlane();
    if (id == 0) return false;
    Plane plane(Eigen::Vector3d(1, 0, 0) + vector(0.5), within(4));
    plane.n *= 1 + within(9e-4);
    map_.setPlaneParameters(id, plane);
    return true;
  }
  bool movePlane() {
    const PlaneId id = anyPlane();
    if (id == 0) return false;
    map_.movePlane(id, motion(0.5, 1));
    return true;
  }
  bool mergePlanes() {
    const PlaneId from = 1 + below(8), into = 1 + below(8);  // which need not be in the map
    const bool effective = from != into && map_.hasPlane(from);
    map_.mergePlanes(from, into);
    return effective;
  }
  bool removePlane() {
    if (map_.planes().empty() || chance(2)) return false;
    map_.removePlane(anyPlane());
    return true;
  }
  bool observePlanes() {
    const PlaneUpdate update = world_.planes();
    const KeyframeId keyframe = anyKeyframe();
    bool any = false;
    for (PlaneObservation seen : update.observations) {
      seen.keyframe = keyframe;
      seen.plane = 1 + below(8);
      if (chance(10)) seen.points.clear();
      if (chance(10)) seen.G(0, 3) += 1;
      if (chance(3)) seen.weight_scale = 0.5, seen.G *= 0.5;
      any |= map_.setPlaneObservation(seen);
    }
    return any;
  }

  bool setState() {
    const KeyframeId id = anyKeyframe();
    NavState state = map_.keyframe(id).state;
    state.T_W_I = state.T_W_I * motion(0.1, 0.1);
    state.v_W += vector(0.1);
    state.bias_gyro += vector(0.01);
    state.bias_accel += vector(0.1);
    map_.setState(id, state, noise_);
    return true;
  }
  bool moveKeyframes() {
    std::map<KeyframeId, SE3> poses;
    for (const auto& [id, kf] : map_.keyframes())
      if (chance(2)) poses[id] = motion(0.5, 1) * kf.state.T_W_I;
    map_.moveKeyframes(poses);
    return !poses.empty();
  }
  bool adoptExtrinsics() {
    map_.adoptExtrinsics(world_.sensor().T_imu_cam * motion(0.02, 0.02));
    return true;
  }
  bool adoptCameraCorrection() {
    CameraCorrection correction;
    correction.offset = within(0.02);
    if (chance(2)) correction.bearing.value = {within(0.01), within(0.01), within(0.01), within(0.01)};
    map_.adoptCameraCorrection(correction);
    return true;
  }
  bool adoptGyroCorrection() {
    map_.adoptGyroCorrection(Eigen::Matrix3d(vector(0.3).asDiagonal()), noise_);
    return true;
  }
  bool widenImuNoise() {
    map_.widenImuNoise(anyKeyframe(), 1 + std::abs(within(3)), noise_);
    return true;
  }

  std::mt19937 random_;
  SimulatedKeyframes world_;
  Map map_;
  LandmarkMaker maker_{500.0};
  ImuNoise noise_;
  LandmarkId next_landmark_ = 1000000;
  std::uint32_t epoch_ = 0;
  double last_stamp_ = -1;
};

}  // namespace

TEST(MapRandom, EveryOperationKeepsTheMapConsistent) {
  std::map<std::string, int> effective;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    RandomMap random(seed);
    std::string last;
    for (int step = 0; step < 500; ++step) {
      const auto& [name, operation] = RandomMap::operations()[random.below(RandomMap::operations().size())];
      last += step % 8 ? ", " + name : name;
      effective[name] += (random.*operation)();
      ASSERT_EQ(checkMap(random.map()), "") << "seed " << seed << ", step " << step << ": " << last;
      if (step % 8 != 7) continue;
      last.clear();
      if (step % 64 != 63) continue;
      const std::string bytes = serialiseMap(random.map(), {}, 1);
      const StoredMap stored =
          parseMap(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), "map", ImuNoise());
      ASSERT_EQ(checkMap(stored.map), "") << "seed " << seed << ", step " << step;
      ASSERT_TRUE(serialiseMap(stored.map, {}, 1) == bytes) << "seed " << seed << ", step " << step;
    }
    EXPECT_GT(random.map().keyframes().size(), 3u) << seed;
  }
  for (const auto& [name, operation] : RandomMap::operations()) EXPECT_GT(effective[name], 20) << name;
}
