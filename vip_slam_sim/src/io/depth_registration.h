// SPDX-License-Identifier: BSD-3-Clause
// Point-to-plane registration of the depth images of a folder.
#pragma once

#include <map>
#include <vector>

#include "vip_slam_sim/io/pose_accuracy.h"

namespace vip_slam {

/// Points on a grid over a depth image, with normals where the surface is smooth.
struct DepthSurface {
  int columns = 0, rows = 0;
  std::vector<Eigen::Vector3d> point, normal;  ///< depth camera's frame, m; a zero normal means none
};

/// Registers images pairwise and caches the surfaces of the last images used.
class PoseRegistration {
 public:
  explicit PoseRegistration(const RgbdFolder& folder) : folder_(folder) {}

  /// `T_j_i`: depth camera of image i to that of image j; its input is the initial guess. False when the overlap is too
  /// small or the surfaces do not constrain every direction. `error`: one sigma of the worst direction.
  bool align(std::size_t i, std::size_t j, SE3* T_j_i, PoseSigma* error);

 private:
  const DepthSurface& surface(std::size_t i);

  const RgbdFolder& folder_;
  std::map<std::size_t, DepthSurface> surfaces_;
};

}  // namespace vip_slam
