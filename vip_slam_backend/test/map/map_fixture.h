// SPDX-License-Identifier: BSD-3-Clause
// A map that grows by simulated keyframes at true poses, checked after each.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <sstream>
#include <string>

#include "back_end/simulated_keyframes.h"
#include "vip_slam_backend/map/landmark_maker.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/map_io/map_file.h"

namespace vip_slam {

inline const double kNan = std::nan("");

struct Fixture {
  SimulatedKeyframes world{11};
  Map map;
  LandmarkMaker maker{500.0};

  void add(int count) {
    for (int k = 0; k < count; ++k) {
      const KeyframePtr kf = world.next();
      NavState state = world.truth(kf->frame.t);
      map.addKeyframe(kf, state, ImuNoise());
      maker.process(kf->id, &map);
      ASSERT_EQ(checkMap(map), "");
    }
  }
  /// The planes that the newest keyframe sees.
  void addPlanes() {
    const PlaneUpdate update = world.planes();
    for (const PlaneEstimate& plane : update.planes) map.setPlane(plane);
    for (const PlaneObservation& o : update.observations) ASSERT_TRUE(map.setPlaneObservation(o));
    for (const auto& [landmark, plane] : update.associated)
      if (map.hasLandmark(landmark)) map.associate(landmark, plane);
    ASSERT_EQ(checkMap(map), "");
  }
  /// A keyframe of another session.
  KeyframePtr addStored() {
    auto stored = std::make_shared<Keyframe>(*world.next());
    stored->previous = 0;
    map.restoreKeyframe(stored, world.truth(stored->frame.t), 0, {}, ImuNoise());
    return stored;
  }
};

/// The first landmark that fulfils the condition; kNoLandmark: none.
template <class Condition>
LandmarkId findLandmark(const Map& map, const Condition& condition) {
  for (const LandmarkId id : map.landmarkIds())
    if (condition(map.landmark(id))) return id;
  return kNoLandmark;
}

/// A feature of the keyframe without a landmark.
inline MapObservation freeFeature(const Map& map, KeyframeId id) {
  const std::vector<LandmarkId>& links = map.keyframe(id).landmarks;
  for (std::uint32_t f = 0; f < links.size(); ++f)
    if (links[f] == kNoLandmark) return {id, f};
  ADD_FAILURE() << "all features of keyframe " << id << " have a landmark";
  return {};
}

/// Equal for maps that nothing distinguishes, in what is saved, what is not, and the objects that are shared.
inline std::string fingerprint(const Map& map) {
  std::ostringstream out;
  out.precision(17);
  out << serialiseMap(map, {}, 0);
  for (const auto& [id, kf] : map.keyframes()) {
    out << id << ' ' << kf.stored << kf.next << ' ' << kf.data << kf.imu << kf.preintegration << kf.gyro_correction;
    for (const auto& [plane, seen] : kf.planes) out << plane << seen.camera_correction.offset << ' ';
  }
  for (const LandmarkId id : map.landmarkIds()) out << id << ' ';
  const MapChanges changes = Map(map).takeChanges();
  out << changes.removed_keyframes.size() << ' ' << changes.removed_landmarks.size() << ' '
      << changes.merged_landmarks.size();
  return out.str();
}

/// Expects the operation to be refused for this reason, and the map to be what it was.
inline void expectRefused(Map* map, const std::string& reason, const std::function<void()>& operation) {
  const std::string before = fingerprint(*map);
  try {
    operation();
    ADD_FAILURE() << "accepted, expected: " << reason;
  } catch (const MapError& e) {
    EXPECT_NE(std::string(e.what()).find(reason), std::string::npos) << e.what() << "\nexpected: " << reason;
  }
  EXPECT_TRUE(fingerprint(*map) == before) << reason;
  EXPECT_EQ(checkMap(*map), "") << reason;
}

}  // namespace vip_slam
