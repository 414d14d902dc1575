// Points of the map that a camera at a known pose should see, looked for around their projections.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/loop/place_pose.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

/// A landmark, or a corner of one keyframe that no other saw and that has depth.
struct MapPoint {
  Eigen::Vector3d p_W;
  double sigma = 0;  ///< of p_W along a ray to it, metres
  LandmarkId landmark = kNoLandmark;
  KeyframeId keyframe = 0;    ///< who sees it,
  std::uint32_t feature = 0;  ///< and in which feature
};

/// The point behind a feature of a keyframe of the map. False when it has neither landmark nor depth.
bool mapPointOf(const Map& map, KeyframeId keyframe, std::uint32_t feature, MapPoint* point);

/// Points behind all features of some keyframes; each landmark once.
std::vector<MapPoint> mapPointsOf(const Map& map, const std::vector<KeyframeId>& keyframes);

/// A query feature that shows `p_W`.
PlaceMatch makePlaceMatch(const Feature& feature, const MapPoint& point);

/// Keyframes that look the way a camera at T_W_C does, nearest views first, at most `most`; only those that `allowed`
/// lets pass (empty: all).
std::vector<KeyframeId> viewsAlong(const Map& map, const SE3& T_W_C, std::size_t most,
                                   const std::function<bool(KeyframeId)>& allowed);

struct GuidedMatches {
  std::vector<PlaceMatch> matches;
  std::vector<std::pair<std::uint32_t, LandmarkId>> source;  ///< of each: query feature, landmark or kNoLandmark
};

/// How a point's looks are compared. Strict: by the descriptor nearest to all it was seen with, and each second corner
/// around the projection is a rival; few matches, for loops that odometry backs. Wide: by any descriptor it was seen
/// with, and two detections of one corner are no rivals; more of the true ones, where nothing else helps.
enum class GuidedLooks { kStrict, kWide };

/// Best match of each query feature among the points that project within `radius` px of it. `features`: of the query,
/// taken at T_W_C.
GuidedMatches matchGuided(const Map& map, const std::vector<Feature>& features, const SE3& T_W_C, double radius,
                          const std::vector<MapPoint>& points, const CameraModel& camera, int max_hamming,
                          GuidedLooks looks);

}  // namespace vip_slam
