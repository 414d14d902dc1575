// SPDX-License-Identifier: BSD-3-Clause
// Tests what keyframes saw between two pieces of one plane. Between two tables the floor below is visible; a counter
// that continues behind an object in front of it, or outside the images, was never seen to end.
#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

/// Pairs of planes with a gap that some keyframe saw through: they stay separate also after that keyframe is removed.
class OpenGaps {
 public:
  void add(PlaneId a, PlaneId b) { pairs_.insert(std::minmax(a, b)); }
  bool has(PlaneId a, PlaneId b) const { return pairs_.count(std::minmax(a, b)) > 0; }
  /// Transfers the pairs of `from` to `into`.
  void rename(PlaneId from, PlaneId into);
  void remove(PlaneId id);
  void clear() { pairs_.clear(); }

 private:
  std::set<std::pair<PlaneId, PlaneId>> pairs_;
};

/// Data needed to check a map's planes against its keyframes.
struct SceneView {
  const PlaneViews& views;
  const CameraModel& camera;
  double see_through;  ///< metres behind a plane, beyond noise, from which depth counts as behind it
  OpenGaps& open_gaps;
};

/// Whether there may be an opening between two pieces, tested at points along the shortest lines from one to the other:
/// more than a few points are open, or more than half of them are undecided. A point is open when a keyframe that shows
/// one of the pieces sees through it: it is in the image, within range, and depth is behind the plane or, unless it is
/// seen at a flat angle, missing. It is undecided when it is in an image but too far away or seen too flat. It is
/// hidden when something is in front of it, or it is outside all images. True when no keyframe shows one of the pieces,
/// as with a loaded map.
bool gapMayBeOpen(const PlaneTrack& small, const PlaneTrack& large, const SceneView& view);

}  // namespace vip_slam
