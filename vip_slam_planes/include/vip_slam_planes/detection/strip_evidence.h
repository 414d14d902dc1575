// Faces seen at so flat an angle that they fill a column or two of the depth grid: sides of pillars, ends of walls.
//
// In one image nothing tells such a strip from one that the mesh spans across a depth edge, from the near surface to
// the one behind it, or from the rim of something round. Those lie along the line of sight and turn with it; a face
// does not. So two keyframes that look at it from different sides must agree on its direction. One of them may show too
// little of it for a strip, as it does from near: then nothing may bend on beside either, as the body of a column does.
#pragma once

#include <deque>
#include <vector>

#include "vip_slam_planes/detection/plane_evidence.h"

namespace vip_slam {

class StripEvidence {
 public:
  StripEvidence(const PlaneDetectionOptions& detection, const PlaneGrowthOptions& growth)
      : keyframes_(static_cast<std::size_t>(detection.keyframes)), growth_(growth) {}

  /// `strips` of detectPlanes(), with indices into `triangles`, and what has no label (< 0); the oldest keyframe goes.
  void add(KeyframeId id, const SE3& T_map_C, const std::vector<MapTriangle>& triangles, const std::vector<int>& label,
           const std::vector<DetectedPlane>& strips);
  void remove(KeyframeId id);
  void clear() { frames_.clear(); }

  /// Planes that strips of the newest keyframe make with those of earlier ones, or one of either with what else the
  /// other shows of it. Strips are used up by that.
  std::vector<JointPlane> detect(const CameraPoses& poses);

 private:
  struct Strip {
    Plane plane_C;
    Eigen::Vector3d centroid_C = Eigen::Vector3d::Zero();
    double sigma = 0;                    ///< of its points along the normal, metres
    bool bends_on = false;               ///< something beside it is turned a little against it
    std::vector<int> index;              ///< of each triangle in the keyframe's mesh
    std::vector<MapTriangle> triangles;  ///< in the camera frame
  };
  struct Frame {
    KeyframeId id;
    std::vector<Strip> strips;
    std::vector<MapTriangle> upright;  ///< all that has no label, in the camera frame
    std::vector<int> index;            ///< of each of those in the keyframe's mesh
  };
  /// A strip where its keyframe is now.
  struct Placed {
    const Strip* strip;
    KeyframeId keyframe;
    SE3 T_C_map;
    Plane plane;
    Eigen::Vector3d centroid;
  };
  Placed place(const Frame& frame, const Strip& strip, const CameraPoses& poses) const;
  bool isOneFace(const Placed& a, const Placed& b) const;
  /// What the frame shows of the face that a strip of another frame may be, when it is a face of its own.
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
