// What several keyframes of one odometry together say for a place of the map, and where they stand there. A door frame
// that looks like another explains a corner of the image; the place itself explains most of what the map's views of it
// cover.
#pragma once

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "vip_slam_backend/loop/place_verifier.h"
#include "vip_slam_backend/loop/scene_agreement.h"

namespace vip_slam {

struct PlaceSupport {
  bool found = false;
  SE3 T_W_C;                                ///< camera of the newest keyframe
  Matrix6d information = Matrix6d::Zero();  ///< of its perturbation (theta, t)
  int matches = 0;                          ///< inliers of all keyframes together
  int points = 0;                           ///< distinct points of the map among them, 5 cm apart
  int covered = 0;          ///< features with depth whose spot the map's views of this place show as well
  int covered_cells = 0;    ///< cells of the images (an eighth by a sixth) with covered features
  int explained_cells = 0;  ///< of these, with an inlier
  int established = 0;      ///< landmarks of several views that the keyframes should see here, each time counted
  int refound = 0;          ///< of these, inliers
  DepthAgreement depth;     ///< of all keyframes, each against the nearest view
  KeyframeId match = 0;     ///< the nearest view of the newest keyframe, 0 when the map has none
  std::vector<std::pair<std::uint32_t, LandmarkId>> landmarks;  ///< inliers of the newest: feature, landmark of the map
  double explainedCells() const { return covered_cells ? static_cast<double>(explained_cells) / covered_cells : 0; }
  /// How much speaks for it: points found again, weighed by what they leave unexplained of the image, by how many of
  /// the landmarks that should be there are, and by the depth that contradicts. A wrong place can be strong in one of
  /// them, a door frame in points, a bare wall in depth, not in all.
  double evidence() const;
};

/// `keyframes`: of one odometry, newest last. `T_W_odom`: where it may lie in the map, a few pixels wrong at most.
/// Points and views are those of keyframes that `allowed` lets pass (empty: all). Not found when the pose does not
/// hold.
PlaceSupport placeSupport(const Map& map, const std::vector<KeyframePtr>& keyframes, const SE3& T_W_odom,
                          const PlaceVerifier& verifier, const std::function<bool(KeyframeId)>& allowed);

/// The cameras of keyframes of one odometry as a rig; its body is the camera of the newest (last).
CameraRig rigOf(const std::vector<KeyframePtr>& keyframes);

}  // namespace vip_slam
