// What keyframes saw between two pieces of one plane. Beside a table one sees what is below it; that a counter goes on
// behind what stands before it, or beyond the edge of the images, nobody saw.
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

/// Pairs of planes that somebody has looked through between: they stay two when the keyframe that saw it has gone.
class OpenGaps {
 public:
  void add(PlaneId a, PlaneId b) { pairs_.insert(std::minmax(a, b)); }
  bool has(PlaneId a, PlaneId b) const { return pairs_.count(std::minmax(a, b)) > 0; }
  /// What was seen beside `from` was seen beside `into`.
  void rename(PlaneId from, PlaneId into);
  void remove(PlaneId id);
  void clear() { pairs_.clear(); }

 private:
  std::set<std::pair<PlaneId, PlaneId>> pairs_;
};

/// What it takes to look at a map's planes once more.
struct SceneView {
  const std::map<KeyframeId, KeyframePtr>& keyframes;
  const CameraPoses& poses;  ///< of those that count
  const CameraModel& camera;
  const DepthNoise& noise;
  double see_through;  ///< metres behind a plane, beyond noise, from which depth counts as behind it
  OpenGaps& open_gaps;
};

/// Whether there may be an opening between two pieces, along the shortest ways from one to the other: more than a few
/// places are open, or nothing tells of more than half of them. A place is open when a keyframe that shows one of the
/// pieces looks through it: in the image, within range, and depth shows something behind the plane or, unless it is
/// seen flat, nothing at all. One that is in an image too far away or too flat tells nothing. Something before it, or
/// the edge of every image, hides it. Taken for open when no keyframe shows one of the pieces, as when its map was
/// loaded.
bool gapMayBeOpen(const PlaneTrack& small, const PlaneTrack& large, const SceneView& view);

}  // namespace vip_slam
