// SPDX-License-Identifier: BSD-3-Clause
// A map for the file tests: a walk along a corridor with landmarks, planes, IMU and depth, everything filled.
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_core/testing/analytic_motion.h"

namespace vip_slam {

inline Map syntheticMap(int keyframes, int features, double imu_rate, std::uint64_t seed = 1, int grid = 8) {
  std::mt19937_64 random(seed);
  const auto uniform = [&random](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  Map map;
  const ImuNoise noise;
  PlaneEstimate floor;
  floor.id = 3;
  floor.kind = PlaneKind::kHorizontal;
  floor.plane = Plane(Eigen::Vector3d(0, 0, 1), 0.01);
  floor.area = 12;
  floor.keyframes = 5;
  floor.polygons.push_back({{{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0}}, {{{1, 1, 0}, {2, 1, 0}, {1, 2, 0}}}});
  map.setPlane(floor);
  PlaneEstimate wall;
  wall.id = 9;
  wall.kind = PlaneKind::kVertical;
  wall.plane = Plane(Eigen::Vector3d(0.6, 0.8, 0), -2.5);
  map.setPlane(wall);
  map.setPlaneParameters(9, wall.plane);

  const testing::AnalyticMotion motion;
  LandmarkId next = 0;
  for (int k = 0; k < keyframes; ++k) {
    auto kf = std::make_shared<Keyframe>();
    kf->id = static_cast<KeyframeId>(k + 1);
    const double t = 100 + 0.5 * k;
    kf->frame.t = t;
    kf->frame.epoch = k < keyframes / 2 ? 2 : 5;
    kf->frame.status.state = TrackingState::kTracking;
    kf->frame.state = motion.stateAt(t);
    kf->frame.T_I_C = SE3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d(0.05, 0, 0.02));
    const bool first = k == 0 || k == keyframes / 2;
    kf->previous = first ? 0 : kf->id - 1;
    if (!first) kf->imu = motion.imu(t - 0.5, t, imu_rate);
    if (k % 4 == 1) {
      kf->motion.T_a_b = motion.stateAt(t - 0.5).T_W_I.inverse() * kf->frame.state.T_W_I;
      kf->motion.covariance.setConstant(1e-6);
      kf->motion.covariance.diagonal().array() += 1e-5 * (k + 1);
    }
    for (int f = 0; f < features; ++f) {
      Feature feature;
      feature.id = f % 3 ? 1000 * f + k / 3 : kNoLandmark;  // a track lives for three keyframes
      feature.pixel = Eigen::Vector2f(uniform(0, 640), uniform(0, 480));
      feature.xy = Eigen::Vector2f((feature.pixel.x() - 320) / 500, (feature.pixel.y() - 240) / 500);
      if (f % 4) {
        feature.depth = static_cast<float>(uniform(0.5, 6));
        feature.depth_sigma = 0.01f;
        feature.pixel_sigma = 0.25f;
      }
      feature.angle = static_cast<float>(uniform(0, 6));
      feature.octave = static_cast<std::uint8_t>(f % 3);
      for (auto& byte : feature.descriptor) byte = static_cast<std::uint8_t>(random() >> 56);
      kf->frame.features.push_back(feature);
    }
    auto& g = kf->frame.depth_grid;
    g.stride = 8;
    g.offset = 4;
    g.cols = grid;
    g.rows = grid;
    for (int n = 0; n < grid * grid; ++n) g.z.push_back(n % 5 ? static_cast<float>(uniform(0.5, 6)) : 0.f);
    NavState state = kf->frame.state;
    state.T_W_I =
        SE3(Eigen::Quaterniond(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), 2).normalized(), state.T_W_I.t());
    map.addKeyframe(kf, state, noise);
    // Two of three features see landmarks of the keyframe before, the rest are new.
    for (int f = 0; f < features; ++f) {
      const MapObservation o{kf->id, static_cast<std::uint32_t>(f)};
      if (k > 0 && f % 3 != 2 && map.keyframe(kf->id - 1).landmarks[f] != kNoLandmark)
        map.addObservation(map.keyframe(kf->id - 1).landmarks[f], o);
      else if (f % 5)
        map.addLandmark(next++, Eigen::Vector3d(uniform(-9, 9), uniform(-9, 9), uniform(0, 3)), o);
    }
    PlaneObservation observation;
    observation.keyframe = kf->id;
    observation.plane = k % 2 ? 3 : 9;
    observation.G = Eigen::Vector4d(uniform(1, 2), 3, 4, 5).asDiagonal();
    observation.weight_scale = 0.5;
    for (int p = 0; p < 20; ++p)
      observation.points.push_back({Eigen::Vector3f(uniform(-1, 1), uniform(-1, 1), uniform(1, 4)), 0.01f});
    map.setPlaneObservation(observation);
  }
  for (LandmarkId id = 0; id < next; id += 7)
    if (map.hasLandmark(id)) map.associate(id, id % 2 ? 3 : 9);
  // Ids with gaps and merges, as after a run.
  for (LandmarkId id = 10; id + 1 < next; id += 50)
    if (map.hasLandmark(id) && map.hasLandmark(id + 1)) map.mergeLandmarks(id + 1, id);
  map.keyframe(2).loop_keyframe = true;
  return map;
}

/// What the bytes of a map file hold.
inline StoredMap parse(const std::string& bytes) {
  return parseMap(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), "test.vsm", ImuNoise());
}

}  // namespace vip_slam
