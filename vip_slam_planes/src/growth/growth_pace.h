// SPDX-License-Identifier: BSD-3-Clause
// Which tracked frames grow planes: those that show something new.
#pragma once

#include <optional>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

class GrowthPace {
 public:
  /// Whether the camera has moved or turned enough since the last frame that grew planes.
  bool due(const SE3& T_map_C, const PlaneGrowthOptions& options) const {
    if (!grown_at_) return true;
    const SE3 moved = grown_at_->inverse() * T_map_C;
    return !(moved.t().norm() < options.min_move && logSO3(moved.rotation()).norm() < options.min_turn_deg * kDegree);
  }
  void grew(const SE3& T_map_C) { grown_at_ = T_map_C; }
  void clear() { grown_at_.reset(); }

 private:
  std::optional<SE3> grown_at_;  ///< camera pose
};

}  // namespace vip_slam
