// SPDX-License-Identifier: BSD-3-Clause
// A wall before a camera that moves along it, for tests of the homographies built from a map.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/optimisation/problem_builder.h"

namespace vip_slam {

// A wall at z = 3 before a camera that moves along x, without noise; `shift` pixels are added to one landmark's views.
struct Wall {
  static constexpr double kFocal = 500;
  static constexpr int kKeyframes = 8, kLandmarks = 12;

  Map map;
  BuilderSettings settings;

  /// A reading's sigma is 5 mm, of which `parts` are the parts.
  explicit Wall(
      LandmarkId odd = 0, const std::function<double(int)>& shift = [](int) { return 0.0; },
      const DepthNoiseParts& parts = {1, 0}) {
    settings.focal = kFocal;
    settings.measurement.surface_sigma = 1e-5;  // flat
    settings.depth_noise.a = 0.005;
    settings.depth_noise.b = 0;
    const ImuNoise noise;
    for (int k = 0; k < kKeyframes; ++k) {
      auto keyframe = std::make_shared<Keyframe>();
      keyframe->id = k + 1;
      keyframe->depth_noise = parts;
      keyframe->frame.t = 0.5 * k;
      NavState state;
      state.t = keyframe->frame.t;
      state.T_W_I = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1 * k, 0, 0));
      keyframe->frame.state = state;
      for (int l = 0; l < kLandmarks; ++l) {
        const Eigen::Vector3d p = point(l) - state.T_W_I.t();
        Feature f;
        f.id = l + 1;
        f.xy = Eigen::Vector2d(p.x() / p.z() + (f.id == odd ? shift(k) / kFocal : 0.0), p.y() / p.z()).cast<float>();
        keyframe->frame.features.push_back(f);
      }
      map.addKeyframe(keyframe, state, noise);
    }
    PlaneEstimate wall;
    wall.id = 1;
    wall.plane = Plane(Eigen::Vector3d(0, 0, -1), 3);
    map.setPlane(wall);
    PlaneObservation seen;
    seen.plane = 1;
    seen.keyframe = 1;
    seen.G = Eigen::Matrix4d::Identity();
    seen.points.push_back({Eigen::Vector3f(0, 0, 3), 1.0f});
    map.setPlaneObservation(seen);
    for (int l = 0; l < kLandmarks; ++l) {
      map.addLandmark(l + 1, point(l), {1, static_cast<std::uint32_t>(l)});
      for (int k = 1; k < kKeyframes; ++k)
        map.addObservation(l + 1, {KeyframeId(k + 1), static_cast<std::uint32_t>(l)});
      map.associate(l + 1, 1);
    }
    EXPECT_EQ(checkMap(map), "");
  }
  /// Assigns view `k` of a landmark to another track.
  void track(int k, LandmarkId landmark, LandmarkId track) {
    auto data = std::make_shared<Keyframe>(*map.keyframe(k + 1).data);
    data->frame.features[static_cast<std::size_t>(landmark - 1)].id = track;
    map.keyframe(k + 1).data = data;
  }
  // Makes views of a landmark those of a track that began beyond the reach of the depth camera.
  void slide(const std::vector<int>& views, LandmarkId landmark) {
    for (const int k : views) {
      auto data = std::make_shared<Keyframe>(*map.keyframe(k + 1).data);
      data->frame.features[static_cast<std::size_t>(landmark - 1)].pixel_sigma = 0.6f;
      map.keyframe(k + 1).data = data;
    }
  }
  /// Moves keyframe `k`, which then sees all points from there; `noise`: what to add to a view, px.
  void lookFrom(
      int k, const SE3& T_W_C, const std::function<double()>& noise = [] { return 0.0; }) {
    NavState state = map.keyframe(k + 1).state;
    state.T_W_I = T_W_C;
    map.setState(k + 1, state, ImuNoise());
    auto data = std::make_shared<Keyframe>(*map.keyframe(k + 1).data);
    for (int l = 0; l < kLandmarks; ++l) {
      const Eigen::Vector3d p = T_W_C.inverse() * point(l);
      const Eigen::Vector2d pixel(kFocal * p.x() / p.z() + noise(), kFocal * p.y() / p.z() + noise());
      data->frame.features[l].xy = (pixel / kFocal).cast<float>();
    }
    map.keyframe(k + 1).data = data;
  }
  /// Depth points of keyframe `k` all over the wall, without noise.
  void seeDepth(int k) {
    PlaneObservation seen;
    seen.plane = 1;
    seen.keyframe = k + 1;
    const SE3 T_C_W = map.keyframe(k + 1).T_W_C().inverse();
    for (double x = -0.6; x < 0.7; x += 0.3)
      for (double y = -0.6; y < 0.7; y += 0.3) {
        seen.points.push_back({(T_C_W * Eigen::Vector3d(x, y, 3)).cast<float>(), 0.005f});
        const Eigen::Vector4d p = seen.points.back().p_C.cast<double>().homogeneous();
        seen.G += p * p.transpose() / (0.005 * 0.005);
      }
    map.setPlaneObservation(seen);
  }
  static Eigen::Vector3d point(int l) { return {0.3 * (l % 4) - 0.3, 0.4 * (l / 4) - 0.4, 3.0}; }

  int pairs(bool shared) {
    settings.shared_hosts = shared;
    int sum = 0;
    for (const BaHomography& h : buildProblem(map, globalScope(map), settings).problem.homographies) sum += h.pairs;
    return sum;
  }
  bool isPoint(LandmarkId id, bool shared) {
    settings.shared_hosts = shared;
    const BuiltProblem built = buildProblem(map, globalScope(map), settings);
    return std::count(built.points.begin(), built.points.end(), id) > 0;
  }
};

}  // namespace vip_slam
