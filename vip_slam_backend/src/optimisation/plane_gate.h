// SPDX-License-Identifier: BSD-3-Clause
// Selects the depth points of an observation that belong to its plane. Points of a cupboard or a notice board in front
// of a wall can be among the samples of the wall; once compressed into G they cannot be separated and would bias the
// keyframe, so they are removed before.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// `plane_C`: present estimate (n, d) of the plane in the observation's camera. Keeps the points within three sigmas of
/// their median distance, since the keyframe's own error moves all of them alike; none when these are fewer than half.
/// With the median more than 5 cm off, either the keyframe has drifted or most points lie on another surface; then nine
/// tenths must agree, which only a drifted keyframe explains.
class PlaneGate {
 public:
  PlaneGate(const PlaneObservation& observation, const Eigen::Vector4d& plane_C);

  bool all() const { return all_; }                       ///< all points belong: use the observation's own G
  const std::vector<int>& kept() const { return kept_; }  ///< when not all: indices of the points that belong
  /// G of the kept points, scaled as the observation's; zero when none is kept.
  Eigen::Matrix4d G() const;
  int points() const { return static_cast<int>(all_ ? observation_.points.size() : kept_.size()); }

 private:
  const PlaneObservation& observation_;
  bool all_ = true;
  std::vector<int> kept_;
};

}  // namespace vip_slam
