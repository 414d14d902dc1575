// SPDX-License-Identifier: BSD-3-Clause
// Evidence of several keyframes of one odometry for a place of the map, and their pose there. A door frame that looks
// like another one explains one corner of the image; the true place explains most of what the map's views of it cover.
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
  Matrix6d information = Matrix6d::Zero();  ///< of the perturbation (theta, t) of T_W_C
  int matches = 0;                          ///< inliers of all keyframes together
  int points = 0;                           ///< distinct map points among the inliers, one per cell of 5 cm
  int covered = 0;          ///< features with depth whose point the map's views of this place show as well
  int covered_cells = 0;    ///< cells of the images (an eighth by a sixth) with covered features
  int explained_cells = 0;  ///< covered cells that contain an inlier
  int established = 0;      ///< landmarks with several views that should be visible here, counted per keyframe
  int refound = 0;          ///< how many of these are inliers
  DepthAgreement depth;     ///< of all keyframes, each against the nearest view
  KeyframeId match = 0;     ///< the nearest view of the newest keyframe, 0 when the map has none
  std::vector<std::pair<std::uint32_t, LandmarkId>> landmarks;  ///< inliers of the newest: feature, landmark of the map
  double explainedCells() const { return covered_cells ? static_cast<double>(explained_cells) / covered_cells : 0; }
  /// Score of the place: points times the share of covered cells that are explained, times the share of established
  /// landmarks found again, over the share of contradicting depth. A wrong place can be strong in one of them (a door
  /// frame in points, a bare wall in depth), but not in all.
  double evidence() const;
};

/// `keyframes`: of one odometry, newest last. `T_W_odom`: hypothesis of its pose in the map, wrong by a few pixels at
/// most. Points and views are those of keyframes accepted by `allowed` (empty: all). Not found when the refinement
/// fails.
PlaceSupport placeSupport(const Map& map, const std::vector<KeyframePtr>& keyframes, const SE3& T_W_odom,
                          const PlaceVerifier& verifier, const std::function<bool(KeyframeId)>& allowed);

/// The cameras of keyframes of one odometry as a rig; its body is the camera of the newest (last).
CameraRig rigOf(const std::vector<KeyframePtr>& keyframes);

}  // namespace vip_slam
