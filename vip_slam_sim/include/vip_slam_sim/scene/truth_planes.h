// SPDX-License-Identifier: BSD-3-Clause
// The true planes of a scene and how long and how much of each the camera saw.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "vip_slam_core/types/true_plane.h"
#include "vip_slam_sim/render/renderer.h"
#include "vip_slam_sim/scene/scene.h"

namespace vip_slam {

/// Outline of a surface: pieces united exactly, with holes.
std::vector<PlanePolygon> surfaceOutline(const Scene& scene, const Surface& surface);

/// Counts which surfaces frames show. Not thread-safe.
class VisibilityCounter {
 public:
  explicit VisibilityCounter(std::shared_ptr<const Scene> scene);
  /// A frame shown for `seconds`; only depths up to `max_depth` count.
  void add(const FrameBuffers& frame, const CameraModel& camera, const SE3& T_W_C, double seconds, double max_depth);
  double seenSeconds(int surface) const { return seconds_[surface]; }
  double seenArea(int surface) const;

 private:
  struct Grid {
    float u0 = 0, v0 = 0;
    int cols = 0, rows = 0;
    std::vector<char> seen;
  };
  std::shared_ptr<const Scene> scene_;
  std::vector<double> seconds_;
  std::vector<Grid> grids_;
};

/// Planes of at least `min_area` m^2, ids from 1, normals towards free space. seen_seconds counts frames of which the
/// plane filled at least 0.5 % within depth range, seen_area the area that was ever in view.
std::vector<TruePlane> truthPlanes(const Scene& scene, const VisibilityCounter& seen, double min_area = 0.02);

}  // namespace vip_slam
