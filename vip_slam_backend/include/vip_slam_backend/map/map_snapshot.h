// SPDX-License-Identifier: BSD-3-Clause
// A copy of the map for readers in other threads: runner, publishers, report.
#pragma once

#include <cstdint>
#include <vector>

#include "vip_slam_core/trajectory/anchored_trajectory.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

struct SnapshotKeyframe {
  KeyframeId id = 0;
  double t = 0;  ///< image stamp
  std::uint32_t epoch = 0;
  NavState state;  ///< T_map_I, v, biases
  SE3 T_chain_C;   ///< as published by the front end, see TrackedFrame
  SE3 T_I_C;       ///< present camera-IMU extrinsics
  std::uint32_t landmarks = 0;
  bool stored = false;  ///< of a loaded map
  bool placed = true;   ///< false: in a part of the map that no loop ties to the rest; its place is a guess
};

/// Scale of the map according to the accelerometer, see optimisation/inertial_scale.h.
struct InertialScale {
  double factor = 1;  ///< true distance over the map's distance
  double sigma = 0;   ///< one sigma of factor; 0: not known
};

struct BackEndStatistics {
  std::uint64_t keyframes_received = 0;
  std::uint64_t plane_landmarks = 0;
  std::uint64_t reobserved = 0;   ///< landmarks found again by projection
  std::uint64_t merged = 0;       ///< duplicate tracks joined
  std::uint64_t outliers = 0;     ///< observations removed by residual
  std::uint64_t without_imu = 0;  ///< keyframes whose IMU samples do not hold the motion since the one before
  double odometry_variance = 1;   ///< factor on the odometry's covariance that is in use
  InertialScale scale;            ///< of the last global adjustment, or from some keyframes ago
};

struct MapSnapshot {
  std::uint64_t revision = 0;
  std::uint32_t epoch = 0;
  SE3 T_map_odom;
  std::vector<SnapshotKeyframe> keyframes;  ///< ascending id
  std::vector<LandmarkEstimate> landmarks;  ///< ascending id
  std::vector<PlaneEstimate> planes;        ///< parameters as optimised
  std::vector<LoopEvent> loops;             ///< all so far
  /// Localisation only: keyframes that were found in the map without entering it, oldest first.
  std::vector<Anchor> localised;
  BackEndStatistics statistics;
};

/// Anchors of the odometry in the map: the map's keyframes and those that were only localised in it; ascending times.
std::vector<Anchor> anchorsOf(const MapSnapshot& snapshot);

/// First and last stamps of runs of this session's keyframes whose place in the map is a guess.
std::vector<std::pair<double, double>> guessedTimes(const MapSnapshot& snapshot);

}  // namespace vip_slam
