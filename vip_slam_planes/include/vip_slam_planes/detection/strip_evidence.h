// SPDX-License-Identifier: BSD-3-Clause
// Evidence of faces seen at such a flat angle that they fill only a column or two of the depth grid: sides of pillars,
// ends of walls.
//
// In one image such a strip cannot be distinguished from one that the mesh spans across a depth edge, from the near
// surface to the one behind it, or from the rim of a round body. Those follow the line of sight when the camera moves;
// a face does not. So two keyframes that look at it from different sides must agree on its direction. One of them may
// show too little of it for a strip, as from near: then the surface must not bend on next to either, as a column does.
#pragma once

#include <deque>
#include <vector>

#include "vip_slam_planes/detection/plane_evidence.h"

namespace vip_slam {

class StripEvidence {
 public:
  StripEvidence(const PlaneDetectionOptions& detection, const PlaneGrowthOptions& growth)
      : keyframes_(static_cast<std::size_t>(detection.keyframes)), growth_(growth) {}

  /// Adds `strips` of detectPlanes(), with indices into `triangles`, and the triangles without label (< 0); drops the
  /// oldest keyframe.
  void add(KeyframeId id, const SE3& T_map_C, const std::vector<MapTriangle>& triangles, const std::vector<int>& label,
           const std::vector<DetectedPlane>& strips);
  void remove(KeyframeId id);
  void clear() { frames_.clear(); }

  /// Planes from strips of the newest keyframe together with strips of earlier ones, or from a strip of either with
  /// other unlabelled triangles of the other. Strips that were used are removed.
  std::vector<JointPlane> detect(const CameraPoses& poses);

 private:
  struct Strip {
    Plane plane_C;
    Eigen::Vector3d centroid_C = Eigen::Vector3d::Zero();
    double sigma = 0;                    ///< of its points along the normal, metres
    bool bends_on = false;               ///< a surface next to it is turned a little, as on a round body
    std::vector<int> index;              ///< of each triangle in the keyframe's mesh
    std::vector<MapTriangle> triangles;  ///< in the camera frame
  };
  struct Frame {
    KeyframeId id;
    std::vector<Strip> strips;
    std::vector<MapTriangle> upright;  ///< upright triangles without label, in the camera frame
    std::vector<int> index;            ///< of each of those in the keyframe's mesh
  };
  /// A strip at its keyframe's present pose.
  struct Placed {
    const Strip* strip;
    KeyframeId keyframe;
    SE3 T_C_map;
    Plane plane;
    Eigen::Vector3d centroid;
  };
  Placed place(const Frame& frame, const Strip& strip, const CameraPoses& poses) const;
  bool isOneFace(const Placed& a, const Placed& b) const;
  /// Collects the frame's unlabelled triangles on the plane of another frame's strip into `remains`. False when they
  /// are too few or bend on.
  bool remainsOf(const Placed& strip, const Frame& frame, const CameraPoses& poses, Strip* remains) const;
  std::vector<JointPlane> pairsOfStrips(const CameraPoses& poses);
  std::vector<JointPlane> stripsWithRemains(const CameraPoses& poses);
  void take(const Placed& placed, JointPlane* face) const;
  bool fit(const Placed& mine, JointPlane* face) const;

  std::size_t keyframes_;
  PlaneGrowthOptions growth_;
  std::deque<Frame> frames_;  ///< oldest first
};

}  // namespace vip_slam
