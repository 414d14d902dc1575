// How good is a plane map: which true planes were found, how often, how exactly, and which planes are invented.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "vip_slam_core/types/plane_map.h"
#include "vip_slam_eval/statistics.h"

namespace vip_slam {

struct PlaneMatchOptions {
  double max_angle = 10.0 * M_PI / 180.0;  ///< radians, normals on the same side
  double max_distance = 0.10;              ///< metres, mean over the estimated outline
  double min_overlap = 0.25;               ///< of the smaller of both areas
  double min_area = 1.0;                   ///< m^2 a true plane must show to count for recall
  double min_seconds = 2.0;                ///< it must have been in view, where the truth says so
  double false_area = 0.5;                 ///< m^2 above which an invented plane is a large one
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
  std::size_t represented_by = 0;  ///< estimates whose best truth it is; above one: duplicates
  double visible_area = 0;         ///< m^2
  double covered_area = 0;         ///< m^2 under estimates
};

struct PlaneMetrics {
  std::size_t expected = 0;  ///< true planes that count
  std::size_t found = 0;     ///< of these
  double recall = 0;         ///< found / expected; 1 when nothing was expected
  std::size_t estimated = 0;
  std::size_t duplicates = 0;          ///< estimates too many
  std::size_t false_planes = 0;        ///< estimates that no true plane explains
  std::size_t large_false_planes = 0;  ///< of these, larger than options.false_area
  std::size_t forced_planes = 0;       ///< horizontal or vertical estimates of true planes that are neither
  ErrorStatistics normal;              ///< degrees
  ErrorStatistics distance;            ///< metres
  std::vector<PlaneMatch> matches;
  std::vector<TruePlaneResult> truths;
};

/// Both in the same world: bring estimates there with transformPlanes().
PlaneMetrics planeMetrics(const std::vector<PlaneEstimate>& truth, const std::vector<PlaneEstimate>& estimate,
                          const PlaneMatchOptions& options = {});

/// Planes and polygons of B expressed in A.
std::vector<PlaneEstimate> transformPlanes(const SE3& T_A_B, std::vector<PlaneEstimate> planes);

}  // namespace vip_slam
