// SPDX-License-Identifier: BSD-3-Clause
// What a depth image says of a place: that something is there, hides it, or lies behind it. One test for all who ask.
#pragma once

#include <algorithm>
#include <limits>

#include <Eigen/Core>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"

namespace vip_slam {

enum class Sight {
  kOutside,  ///< not in the image, or without grid nodes around it
  kNothing,  ///< none of the nodes around it has depth
  kHidden,   ///< all that is measured around it is nearer
  kThere,    ///< a surface passes through it or between the nodes around it
  kThrough,  ///< all that is measured around it is farther: the place is empty
};

/// The four nodes of a depth grid around the projection of a place.
struct SightLine {
  bool inside = false;   ///< the place is in the image and has nodes around it
  int col = 0, row = 0;  ///< of the first of the nodes
  int measured = 0;      ///< number of them with depth
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0;  ///< depths of these, m

  /// Of a place at depth z; `slack` is how far a reading may be from its surface, m along the optical axis.
  Sight at(double z, double slack) const {
    if (!inside) return Sight::kOutside;
    if (measured == 0) return Sight::kNothing;
    if (nearest > z + slack) return Sight::kThrough;
    return z > farthest + slack ? Sight::kHidden : Sight::kThere;
  }
};

/// `p_C`: in the camera's frame, m.
inline SightLine sightLine(const DepthGrid& grid, const CameraModel& camera, const Eigen::Vector3d& p_C) {
  SightLine line;
  Eigen::Vector2d uv;
  if (!(p_C.z() > 0) || !camera.project(p_C, &uv) || !camera.inImage(uv)) return line;
  if (grid.empty() || !grid.nodesAround(uv, &line.col, &line.row)) return line;
  line.inside = true;
  for (int k = 0; k < 4; ++k) {
    const double z = grid.at(line.col + (k & 1), line.row + (k >> 1));
    if (!(z > 0)) continue;
    ++line.measured;
    line.nearest = std::min(line.nearest, z), line.farthest = std::max(line.farthest, z);
  }
  return line;
}

}  // namespace vip_slam
