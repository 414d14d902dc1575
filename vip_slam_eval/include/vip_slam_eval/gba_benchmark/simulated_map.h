// SPDX-License-Identifier: BSD-3-Clause
// A map as the system would have it at the end of a sequence, from a landmark-level simulation: geometry, visibility
// with occlusion, a tracker that loses and finds points, pixel, depth and IMU noise, and drifted initial poses.
#pragma once

#include <map>
#include <string>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

struct SimulatedMapOptions {
  std::string world =
      "rooms";  ///< "rooms": two rooms seen there and back; "corridor": a straight one, never seen again
  int keyframes = 215;
  double keyframe_interval = 0.35;  ///< s
  int plane_points = 2236;          ///< points on planes that the map keeps
  int free_points = 2032;
  double pixel_sigma = 0.7;                 ///< px
  double depth_a = 0.004, depth_b = 0.004;  ///< depth sigma = a + b z^2, metres
  int depth_samples = 50;                   ///< samples per keyframe and plane
  double depth_sample_floor = 0.002;        ///< m
  unsigned seed = 1;
};

struct SimulatedMap {
  Map map;
  std::map<KeyframeId, NavState> truth;
  double focal = 460;
  double pixel_sigma = 0.7;
  ImuNoise noise;
  std::size_t plane_observations = 0, free_observations = 0;
};

/// Throws std::invalid_argument for an unknown world or when the world cannot give that many points.
SimulatedMap simulateMap(const SimulatedMapOptions& options);

}  // namespace vip_slam
