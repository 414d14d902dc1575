// SPDX-License-Identifier: BSD-3-Clause
// Bodies that move independently of the camera: where they are in the newest image, and when one was last seen.
#pragma once

#include <algorithm>
#include <vector>

#include "vip_slam_core/types/feature.h"
#include "vip_slam_frontend/inertial/fault_detection.h"
#include "vip_slam_frontend/tracking/moving_regions.h"

namespace vip_slam::frontend {

class SeenBodies {
 public:
  /// The regions of the image at t_imu, IMU clock, s.
  void see(MovingRegions regions, double t_imu) {
    regions_ = std::move(regions);
    if (regions_.any()) last_imu_t_ = t_imu;
  }
  const MovingRegions& regions() const { return regions_; }
  /// Whether one moved a moment ago: a body that pauses looks static, and the images stay in doubt.
  bool movedLately(double t_imu) const { return t_imu - last_imu_t_ < kFaultMemory; }
  /// Removes the features on them.
  void drop(std::vector<Feature>* features) const {
    if (!regions_.any()) return;
    const auto moves = [&](const Feature& f) { return regions_.moves(f.pixel.cast<double>(), f.depth); };
    features->erase(std::remove_if(features->begin(), features->end(), moves), features->end());
  }
  void reset() { *this = SeenBodies(); }

 private:
  MovingRegions regions_;
  double last_imu_t_ = -1e300;
};

}  // namespace vip_slam::frontend
