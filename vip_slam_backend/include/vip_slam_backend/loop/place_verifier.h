// SPDX-License-Identifier: BSD-3-Clause
// Geometric verification that a keyframe shows a place of the map: descriptor matches by the direct index, RANSAC with
// depth and gravity, guided matching of the neighbourhood's landmarks, refinement with gravity, and an independent
// check by depth.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/loop/place_coverage.h"
#include "vip_slam_backend/loop/place_pose.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/place_recognition/keyframe_database.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

struct PlaceVerification {
  bool accepted = false;
  std::string reason;  ///< why it was refused, or the evidence for it
  KeyframeId match = 0;
  SE3 T_W_I;                                ///< the query's pose in the map, from the matched landmarks
  Matrix6d information = Matrix6d::Zero();  ///< of the perturbation (theta, t) of the query's camera pose
  int inliers = 0;              ///< matches that agree with the pose; of a PlaceSearch, distinct points of the map
  PlaceCoverage coverage;       ///< not of a PlaceSearch
  double depth_agreement = -1;  ///< -1: no depth to compare
  std::vector<std::pair<std::uint32_t, LandmarkId>> landmarks;  ///< inliers: feature of the query, landmark of the map
};

/// Error that depths of a surface share in two images of one camera together, as a share of a reading's sigma.
inline double sharedByTwo(const DepthNoiseParts& noise) { return std::sqrt(2 * noise.shared); }

class PlaceVerifier {
 public:
  PlaceVerifier(const PlaceVerificationOptions& options, std::shared_ptr<const CameraModel> camera);

  /// `T_G_I`: the query's pose in any gravity-aligned frame. Landmarks are taken from keyframes accepted by `allowed`
  /// (empty: all); `database` contains those around `match`.
  PlaceVerification verify(const Map& map, const Keyframe& query, const SE3& T_G_I, const BowResult& query_bow,
                           KeyframeId match, const KeyframeDatabase& database,
                           const std::function<bool(KeyframeId)>& allowed) const;
  /// The same from a predicted pose in the map, without place recognition: starts with guided matching around `match`.
  PlaceVerification track(const Map& map, const Keyframe& query, const SE3& T_W_I, KeyframeId match,
                          const std::function<bool(KeyframeId)>& allowed) const;

  /// Matches of the query's features with map points around `match`, by the direct index; all of camera 0.
  std::vector<PlaceMatch> match(const Map& map, const Keyframe& query, const BowResult& query_bow, KeyframeId match,
                                const KeyframeDatabase& database, const std::function<bool(KeyframeId)>& allowed) const;

  const PlaceVerificationOptions& options() const { return options_; }
  const CameraModel& camera() const { return *camera_; }
  const PlacePoseOptions& poseOptions() const { return pose_options_; }

 private:
  void finish(const Map& map, const Keyframe& query, const SE3& T_G_I, const SE3& start,
              const std::vector<KeyframeId>& around, PlaceVerification* result) const;

  PlaceVerificationOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  PlacePoseOptions pose_options_;
};

}  // namespace vip_slam
