// SPDX-License-Identifier: BSD-3-Clause
// From the map to the pose-plane graph: odometry edges between neighbours in time, edges from earlier loops and shared
// landmarks, and plane edges; the caller adds the new loop.
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

/// Square-root information of the edge from `match` to `query` (frames as in factors/relative_pose.h), with sigmas not
/// below those of the options. `camera_information`: of the perturbation (theta, t) of the query's camera pose in the
/// world; singular: the options' sigmas alone.
Matrix6d loopSqrtInformation(const Matrix6d& camera_information, const SE3& T_W_match, const SE3& T_W_query,
                             const SE3& T_I_C, const PoseGraphOptions& options);

/// All measurements equal the present estimates, so the graph is at its minimum until the caller adds an edge. `loops`:
/// accepted ones (query, match); `same_planes`: (from, into) are one surface; `closing`: the two ends of the loop that the
/// caller will add, over whose way the odometry's common drift adds up; `min_seconds`: keyframes nearer in time
/// are joined by odometry alone.
PosePlaneGraph buildPosePlaneGraph(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops,
                                   const std::vector<std::pair<PlaneId, PlaneId>>& same_planes,
                                   const std::pair<KeyframeId, KeyframeId>& closing, double min_seconds,
                                   const PoseGraphOptions& options);

/// Parts of the map: epochs that loops tie together, directly or via other epochs.
std::vector<EpochPart> epochParts(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops);

/// Keyframes connected to `id` by odometry (the same epoch) and loops, itself included.
std::set<KeyframeId> connectedKeyframes(const Map& map, KeyframeId id,
                                        const std::vector<std::pair<KeyframeId, KeyframeId>>& loops);

/// The part of the map that keeps its place when parts are joined: the largest of those with stored keyframes; else the
/// oldest one that is not smaller than a tenth of the largest, so that the map frame known to users stays. Empty for an
/// empty map.
std::set<KeyframeId> referencePart(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops);

}  // namespace vip_slam
