// What keyframes saw between two pieces of one plane. Beside a table one sees what is below it; that a counter goes on
// behind what stands before it, or beyond the edge of the images, nobody saw.
#pragma once

#include <map>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

/// What it takes to look at a map's planes once more.
struct SceneView {
  const std::map<KeyframeId, KeyframePtr>& keyframes;
  const CameraPoses& poses;  ///< of those that count
  const CameraModel& camera;
  const DepthNoise& noise;
  double see_through;  ///< metres behind a plane, beyond noise, from which depth counts as behind it
};

/// Whether keyframes that show the pieces look through their plane, at more than a few places along the shortest ways
/// from one piece to the other: within range, from the plane's own side and not at a grazing angle, and depth shows
/// something behind it or nothing at all. Taken for open when no keyframe shows one of them, as when its map was
/// loaded.
bool gapIsOpen(const PlaneTrack& small, const PlaneTrack& large, const SceneView& view);

}  // namespace vip_slam
