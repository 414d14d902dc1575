// From the map to the pose-plane graph: odometry edges between neighbours in time, edges that earlier loops and shared
// landmarks give, plane edges, and the new loop.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/loop/pose_plane_graph.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/types/map_update.h"

namespace vip_slam {

/// Diagonal square-root information of a relative pose: angles in radians, position in metres, one sigma each.
Matrix6d diagonalSqrtInformation(double sigma_angle, double sigma_position);

/// Square-root information of the edge from `match` to `query` (frames as in factors/relative_pose.h), never better
/// than the options' floor. `camera_information`: of the perturbation (theta, t) of the query's camera pose in the
/// world; singular: the floor alone.
Matrix6d loopSqrtInformation(const Matrix6d& camera_information, const SE3& T_W_match, const SE3& T_W_query,
                             const SE3& T_I_C, const PoseGraphOptions& options);

/// All measurements at their present values (the graph is at its minimum), except for what the caller adds. `loops`:
/// accepted ones (query, match); `same_planes`: (from, into) are one surface; `min_seconds`: keyframes nearer in time
/// are joined by odometry alone.
PosePlaneGraph buildPosePlaneGraph(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops,
                                   const std::vector<std::pair<PlaneId, PlaneId>>& same_planes, double min_seconds,
                                   const PoseGraphOptions& options);

/// Which epochs of the map loops tie together, directly or by way of others.
std::vector<EpochPart> epochParts(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops);

/// Keyframes that odometry (one epoch) and loops tie to `id`, itself included.
std::set<KeyframeId> connectedKeyframes(const Map& map, KeyframeId id,
                                        const std::vector<std::pair<KeyframeId, KeyframeId>>& loops);

/// The part of the map that the others are brought to: the largest of those with stored keyframes; else the oldest one
/// that is no tenth of the largest, so that what others know the map by stays. Empty for an empty map.
std::set<KeyframeId> referencePart(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops);

}  // namespace vip_slam
