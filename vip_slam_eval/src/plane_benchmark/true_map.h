// SPDX-License-Identifier: BSD-3-Clause
// Replaces the back end when the plane module is evaluated alone: keyframes have their true poses, landmarks the
// weighted mean of their measured positions.
#pragma once

#include <map>
#include <vector>

#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_eval/metrics/association_metrics.h"

namespace vip_slam {

class TrueMap {
 public:
  /// `truth`: poses T_W_I of the IMU on the IMU's clock.
  TrueMap(Trajectory truth, const SensorConfig& sensor) : truth_(std::move(truth)), sensor_(sensor) {}

  /// Gives the frame its true pose, the sensor's extrinsics and epoch 0. False when the truth does not cover it.
  bool place(TrackedFrame* frame) const;
  /// The update with which a back end would answer a placed keyframe: its pose and the landmarks it sees.
  MapUpdate addKeyframe(const Keyframe& keyframe);
  /// Applies the plane module's associations, merges and removals to the landmarks.
  void apply(const PlaneUpdate& update);
  /// Landmarks that have a position, with their plane.
  std::vector<LabelledPoint> points() const;

 private:
  struct Landmark {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  ///< of measured positions, each divided by its variance
    double weight = 0;
    int keyframes = 0;
    PlaneId plane = 0;
  };
  const Trajectory truth_;
  const SensorConfig sensor_;
  std::map<LandmarkId, Landmark> landmarks_;
  std::uint64_t revision_ = 0;
};

}  // namespace vip_slam
