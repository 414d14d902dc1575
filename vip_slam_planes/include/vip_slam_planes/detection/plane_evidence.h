// SPDX-License-Identifier: BSD-3-Clause
// Evidence of planes that no single image shows well enough: a distant wall behind an opening, whose normals are noisy,
// or a dark worktop, which has depth in pieces only. Horizontal planes may start smaller than in one image; tracked
// frames grow them.
//
// Triangles that detection leaves over in a keyframe are kept as patches, small connected pieces of one orientation.
// Their votes go into one histogram over the last keyframes (paper section "Plane Detection and Merging": histograms of
// the whole map); where several keyframes agree, the same tests as for a single image are applied to all their
// triangles together. For a plane that one image starts, it also finds the keyframes that have seen it before.
#pragma once

#include <deque>
#include <utility>
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
  int index;       ///< in that keyframe's mesh
  PlaneId beside;  ///< plane that it is another layer of; 0: none
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

  /// Keeps those triangles of a placed keyframe that have no label (< 0); drops the oldest keyframe. `beside`: the
  /// plane that each triangle is another layer of (other_layers.h), 0: none.
  void add(KeyframeId id, const SE3& T_map_C, const std::vector<MapTriangle>& triangles, const std::vector<int>& label,
           const std::vector<PlaneId>& beside);
  void remove(KeyframeId id);
  void clear() { frames_.clear(); }
  /// To be called when keyframes have moved relative to each other: peaks that failed before are tested again.
  void forgetTests();

  /// Number of keyframes with at least `area` m^2 of left-over triangles on the plane.
  int seenBy(const PlaneTrack& plane, const CameraPoses& poses, double area) const;
  /// Left-over triangles that lie on one of the planes in view, which has grown up to them since, each with that plane;
  /// they are no longer kept. Keyframes without a pose are not used.
  std::vector<std::pair<const PlaneTrack*, EvidenceTriangle>> takeJoining(const CameraPoses& poses,
                                                                          const std::vector<const PlaneTrack*>& known);
  /// Planes from patches of the newest keyframe together with those of earlier ones. `known` are the planes in view;
  /// patches that they explain by now are dropped, unless they were another layer of it, and so are those of a new
  /// plane. Keyframes without a pose are not used. A wall's peak that failed is tested again when a fair part of it is
  /// new.
  std::vector<JointPlane> detect(const CameraPoses& poses, const std::vector<const PlaneTrack*>& known);

 private:
  struct Patch {
    PlaneKind kind;
    Eigen::Vector3d centre_C, n_C;  ///< area-weighted means
    double area = 0;
    bool tested = false;                 ///< was part of a peak that was tested already
    std::vector<int> index;              ///< of each triangle in the keyframe's mesh
    std::vector<PlaneId> beside;         ///< of each triangle: plane that it is another layer of; 0: none
    std::vector<MapTriangle> triangles;  ///< in the camera frame; `neighbour` are indices within the patch
  };
  struct Frame {
    KeyframeId id;
    std::vector<Patch> patches;
  };
  struct Vote {
    std::size_t frame, patch;
  };

  std::vector<Vote> patchesNear(const PlaneTrack& plane, const CameraPoses& poses, std::size_t frame) const;
  std::vector<EvidenceTriangle> collect(const std::vector<Vote>& votes, const CameraPoses& poses) const;
  void forget(const std::vector<Vote>& votes, const std::vector<EvidenceTriangle>& all, const std::vector<char>& used);

  PlaneDetectionOptions detection_;
  PlaneGrowthOptions growth_;
  std::deque<Frame> frames_;  ///< oldest first
};

}  // namespace vip_slam
