// SPDX-License-Identifier: BSD-3-Clause
// Matches points of the map that a camera at a known pose should see with features around their projections.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/loop/place_pose.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

/// A landmark, or a corner with depth that only one keyframe saw.
struct MapPoint {
  Eigen::Vector3d p_W;
  double sigma = 0;  ///< of p_W along a ray to it, metres
  LandmarkId landmark = kNoLandmark;
  KeyframeId keyframe = 0;    ///< a keyframe that sees it
  std::uint32_t feature = 0;  ///< and its feature there
};

/// The point behind a feature of a keyframe of the map. False when it has neither landmark nor depth.
bool mapPointOf(const Map& map, KeyframeId keyframe, std::uint32_t feature, MapPoint* point);

/// Points behind all features of some keyframes; each landmark once.
std::vector<MapPoint> mapPointsOf(const Map& map, const std::vector<KeyframeId>& keyframes);

/// A query feature that shows `p_W`.
PlaceMatch makePlaceMatch(const Feature& feature, const MapPoint& point);

struct GuidedMatches {
  std::vector<PlaceMatch> matches;
  std::vector<std::pair<std::uint32_t, LandmarkId>> source;  ///< of each: query feature, landmark or kNoLandmark
};

/// How descriptors are compared. Strict: with the landmark's medoid descriptor, and any second corner around the
/// projection counts in the ratio test; fewer matches, for loops that odometry supports. Wide: with all descriptors of
/// the landmark, and two detections of one corner do not compete; more true matches, where there is no other evidence.
enum class GuidedLooks { kStrict, kWide };

/// Best match of each query feature among the points that project within `radius` px of it. `features`: of the query,
/// taken at T_W_C.
GuidedMatches matchGuided(const Map& map, const std::vector<Feature>& features, const SE3& T_W_C, double radius,
                          const std::vector<MapPoint>& points, const CameraModel& camera, int max_hamming,
                          GuidedLooks looks);

}  // namespace vip_slam
