// SPDX-License-Identifier: BSD-3-Clause
// Precision and recall of the point-to-plane associations of a map.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vip_slam_core/types/true_plane.h"
#include "vip_slam_eval/metrics/plane_metrics.h"

namespace vip_slam {

/// A map point and the estimated plane it is tied to; plane 0: none.
struct LabelledPoint {
  std::int64_t id = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  PlaneId plane = 0;
  int keyframes = 0;  ///< number of keyframes that observe it
};

/// CSV with the header id,x,y,z,plane,keyframes. Throws std::runtime_error "file:line: what, expected what".
std::vector<LabelledPoint> readLabelledPoints(const std::string& path);
/// Atomic: leaves the complete file or none.
void writeLabelledPoints(const std::string& path, const std::vector<LabelledPoint>& points);

struct AssociationMetrics {
  std::size_t labelled = 0;         ///< points tied to a plane
  std::size_t correct = 0;          ///< of these, on the true plane (distance and outline)
  std::size_t on_found_planes = 0;  ///< points seen often enough that truly lie on a true plane that was found
  std::size_t recovered = 0;        ///< of these, tied to it
  double precision = 1, recall = 1;
};

/// `points` in the truth's world. A point is on a plane when it is within `tolerance` metres of it and inside its
/// outline (or within `tolerance` of the inside). Points seen by fewer than `min_keyframes` keyframes cannot be tied to
/// a plane yet, by the paper's rule, and do not count for recall; every wrongly tied point counts against precision.
AssociationMetrics associationMetrics(const std::vector<LabelledPoint>& points, const std::vector<TruePlane>& truth,
                                      const PlaneMetrics& planes, int min_keyframes = 4, double tolerance = 0.05);

}  // namespace vip_slam
