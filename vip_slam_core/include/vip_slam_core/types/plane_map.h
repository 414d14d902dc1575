// SPDX-License-Identifier: BSD-3-Clause
// The plane module's output to the back end: the plane map and its changes. World here is `map`.
#pragma once

#include <vector>

#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/types/feature.h"

namespace vip_slam {

enum class PlaneKind { kHorizontal = 0, kVertical = 1, kGeneral = 2 };

/// A closed ring of 3D points on the plane, without repeating the first.
using Ring = std::vector<Eigen::Vector3d>;
struct PlanePolygon {
  Ring outer;
  std::vector<Ring> holes;
};

struct PlaneEstimate {
  PlaneId id = 0;
  PlaneKind kind = PlaneKind::kGeneral;
  Plane plane;                         ///< in `map`; n points to the side it was seen from
  std::vector<PlanePolygon> polygons;  ///< disjoint pieces
  double area = 0;                     ///< m^2
  std::uint32_t keyframes = 0;         ///< keyframes that saw it
};

/// Host keyframe of a plane of a loaded map: the plane's area moves with the oldest keyframe that saw it.
struct PlaneHost {
  KeyframeId keyframe = 0;  ///< 0: no such keyframe is left, and the area stays where it is
  std::uint32_t epoch = 0;  ///< of its odometry, see EpochPart
  SE3 T_map_C;
};

struct StoredPlane {
  PlaneEstimate estimate;
  PlaneHost host;
};

/// A depth point on a plane, in the keyframe's camera frame, with one sigma of its own distance error.
struct PlaneSample {
  Eigen::Vector3f p_C;
  float sigma;  ///< metres along the plane normal
};

/// Depth points of one keyframe on one plane (paper section "Compressed Point-to-Plane Measurement").
struct PlaneObservation {
  KeyframeId keyframe = 0;
  PlaneId plane = 0;
  /// G_p = weight_scale * sum 1/sigma^2 [p_C;1][p_C;1]^T over `points`.
  Eigen::Matrix4d G = Eigen::Matrix4d::Zero();
  /// 1 / (1 + w shared^2) with the points' weight w = sum 1/sigma^2: 1/G(3,3) = 1/w + shared^2 is the variance of the
  /// surface's distance, with the error that its points share.
  double weight_scale = 1.0;
  std::vector<PlaneSample> points;     ///< the samples behind G
  CameraCorrection camera_correction;  ///< applied to their readings, see TrackedFrame
};

/// Adds the points of another piece of the same plane in the same keyframe, which share that error.
void addPiece(const PlaneObservation& piece, PlaneObservation* observation);

struct PlaneMerge {
  PlaneId from = 0, into = 0;  ///< `into` is the older id
};

/// Changes since the previous update, in this order: merges, removals, then the rest.
struct PlaneUpdate {
  std::uint64_t revision = 0;  ///< revision of the MapUpdate it was computed with
  double t = 0;
  std::vector<PlaneMerge> merges;
  std::vector<PlaneId> removed;
  std::vector<PlaneEstimate> planes;                       ///< all planes, present estimates
  std::vector<PlaneObservation> observations;              ///< new ones, or replacing the same (keyframe, plane)
  std::vector<std::pair<LandmarkId, PlaneId>> associated;  ///< landmarks found to lie on a plane
  std::vector<LandmarkId> dissociated;                     ///< landmarks that no longer do
};

}  // namespace vip_slam
