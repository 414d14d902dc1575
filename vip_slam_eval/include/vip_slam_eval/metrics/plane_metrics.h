// SPDX-License-Identifier: BSD-3-Clause
// Quality of a plane map: which true planes were found, how often, how accurately, and which estimates are false.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/types/true_plane.h"
#include "vip_slam_eval/metrics/statistics.h"

namespace vip_slam {

struct PlaneMatchOptions {
  double max_angle = 10.0 * kDegree;  ///< radians, normals on the same side
  double max_distance = 0.10;         ///< metres, mean over the estimated outline
  double min_overlap = 0.25;          ///< fraction of the smaller of the two areas
  double min_area = 1.0;              ///< m^2 of a true plane that must be visible for it to count for recall
  double min_seconds = 2.0;           ///< time in view needed to count for recall, where the truth states it
  double false_area = 0.5;            ///< m^2; a false plane above this counts as large
};

struct PlaneMatch {
  PlaneId estimate = 0;
  PlaneId truth = 0;          ///< the true plane it represents best; 0: none, a false plane
  double normal_error = 0;    ///< radians
  double distance_error = 0;  ///< metres, |distance| of the middle of the estimated area to the true plane
  double overlap = 0;         ///< m^2
  double area = 0;            ///< m^2 of the estimate
};

struct TruePlaneResult {
  PlaneId id = 0;
  bool counts = false;             ///< horizontal or vertical, large enough and long enough in view
  bool found = false;              ///< some estimate matches it
  std::size_t represented_by = 0;  ///< estimates whose best match it is; above one: duplicates
  double visible_area = 0;         ///< m^2
  double covered_area = 0;         ///< m^2 under estimates
};

struct PlaneMetrics {
  std::size_t expected = 0;  ///< true planes that count
  std::size_t found = 0;     ///< how many of the expected ones were found
  double recall = 0;         ///< found / expected; 1 when nothing was expected
  std::size_t estimated = 0;
  std::size_t duplicates = 0;          ///< surplus estimates of a true plane
  std::size_t false_planes = 0;        ///< estimates that match no true plane
  std::size_t large_false_planes = 0;  ///< of these, larger than options.false_area
  std::size_t forced_planes = 0;       ///< horizontal or vertical estimates of true planes that are neither
  ErrorStatistics normal;              ///< degrees
  ErrorStatistics distance;            ///< metres
  std::vector<PlaneMatch> matches;
  std::vector<TruePlaneResult> truths;
};

/// Both must be in the same world frame: use transformPlanes() on the estimates first.
PlaneMetrics planeMetrics(const std::vector<TruePlane>& truth, const std::vector<PlaneEstimate>& estimate,
                          const PlaneMatchOptions& options = {});

/// Planes and polygons of B expressed in A.
std::vector<PlaneEstimate> transformPlanes(const SE3& T_A_B, std::vector<PlaneEstimate> planes);

}  // namespace vip_slam
