// Evidence of planes that no single image shows enough of: a wall far away behind an opening, whose normals are noisy,
// or a dark worktop, which gives depth in pieces only. Level planes may start smaller than in one image; frames grow
// them.
//
// What detection leaves over in a keyframe is kept as patches, small connected pieces of one orientation. Their votes
// go into one histogram over the last keyframes (paper section "Plane Detection": histograms of the whole map); where
// several keyframes agree, the same tests as for a single image decide on all their triangles together. A plane that
// one image starts finds here who has seen it before.
#pragma once

#include <deque>
#include <vector>

#include "vip_slam_planes/detection/plane_detector.h"
#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/mesh/map_triangles.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

/// A triangle of a keyframe, in `map`.
struct EvidenceTriangle {
  MapTriangle triangle;
  KeyframeId keyframe;
  int index;  ///< in that keyframe's mesh
};

struct JointPlane {
  PlaneKind kind = PlaneKind::kGeneral;
  Plane plane;  ///< in `map`
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  std::vector<EvidenceTriangle> triangles;
};

class PlaneEvidence {
 public:
  PlaneEvidence(const PlaneDetectionOptions& detection, const PlaneGrowthOptions& growth)
      : detection_(detection), growth_(growth) {}

  /// Keeps those triangles of a placed keyframe that have no label (< 0); the oldest keyframe goes.
  void add(KeyframeId id, const SE3& T_map_C, const std::vector<MapTriangle>& triangles, const std::vector<int>& label);
  void remove(KeyframeId id);
  void clear() { frames_.clear(); }
  /// Keyframes have moved against each other: what made no plane before may do now.
  void forgetTests();

  /// Keyframes of which at least `area` m^2 was left over on the plane.
  int seenBy(const PlaneTrack& plane, const CameraPoses& poses, double area) const;
  /// Planes that patches of the newest keyframe make with those of earlier ones. `known` are the planes in view; what
  /// they explain by now is forgotten, and so is what a new plane takes. Keyframes without a pose count for nothing. A
  /// wall's peak that made no plane is tested again when a fair part of it is new.
  std::vector<JointPlane> detect(const CameraPoses& poses, const std::vector<const PlaneTrack*>& known);

 private:
  struct Patch {
    PlaneKind kind;
    Eigen::Vector3d centre_C, n_C;  ///< area-weighted means
    double area = 0;
    bool tested = false;                 ///< in a peak that was tested already
    std::vector<int> index;              ///< of each triangle in the keyframe's mesh
    std::vector<MapTriangle> triangles;  ///< in the camera frame; neighbours count within the patch
  };
  struct Frame {
    KeyframeId id;
    std::vector<Patch> patches;
  };
  struct Vote {
    std::size_t frame, patch;
  };

  std::vector<EvidenceTriangle> collect(const std::vector<Vote>& votes, const CameraPoses& poses) const;
  void forget(const std::vector<Vote>& votes, const std::vector<EvidenceTriangle>& all, const std::vector<char>& used);

  PlaneDetectionOptions detection_;
  PlaneGrowthOptions growth_;
  std::deque<Frame> frames_;  ///< oldest first
};

}  // namespace vip_slam
