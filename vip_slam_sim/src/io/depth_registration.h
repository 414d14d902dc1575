// Point-to-plane registration of the depth images of a folder.
#pragma once

#include <map>
#include <vector>

#include "vip_slam_sim/io/pose_accuracy.h"

namespace vip_slam {

/// Points on a grid over a depth image, with the normals of smooth places.
struct DepthSurface {
  int columns = 0, rows = 0;
  std::vector<Eigen::Vector3d> point, normal;  ///< depth camera's frame; normal zero: none
};

/// Keeps the surfaces of the last images it was asked for.
class PoseRegistration {
 public:
  explicit PoseRegistration(const RgbdFolder& folder) : folder_(folder) {}

  /// Depth camera of image i into that of image j, m; in: where to begin. False when too little is common to both or
  /// the surfaces leave a direction nearly open. `error`: one sigma of the worst direction.
  bool align(std::size_t i, std::size_t j, SE3* T_j_i, PoseError* error);

 private:
  const DepthSurface& surface(std::size_t i);

  const RgbdFolder& folder_;
  std::map<std::size_t, DepthSurface> surfaces_;
};

}  // namespace vip_slam
