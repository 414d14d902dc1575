// Which depth points of an observation belong to its plane. A cupboard or a notice board before a wall can enter the
// samples of the wall; compressed into G they cannot be told apart any more and pull the keyframe off, so they are left
// out before.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// `plane_C`: (n, d) of the plane in the observation's camera, as estimated now. Kept is what lies within three sigmas
/// of the points' median distance, since the keyframe's own error moves all of them alike: at least half of them, or
/// nothing. With the median more than 5 cm off, either the keyframe has drifted or most points lie on something else;
/// nine tenths must agree then, which is a drifted keyframe.
class PlaneGate {
 public:
  PlaneGate(const PlaneObservation& observation, const Eigen::Vector4d& plane_C);

  bool all() const { return all_; }                       ///< the observation's own G will do
  const std::vector<int>& kept() const { return kept_; }  ///< when not all: indices of the points that belong
  /// Their sum, scaled as the observation's; zero when none is kept.
  Eigen::Matrix4d G() const;
  int points() const { return static_cast<int>(all_ ? observation_.points.size() : kept_.size()); }

 private:
  const PlaneObservation& observation_;
  bool all_ = true;
  std::vector<int> kept_;
};

}  // namespace vip_slam
