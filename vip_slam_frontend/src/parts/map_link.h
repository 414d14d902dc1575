// SPDX-License-Identifier: BSD-3-Clause
// The front end's link to the map: its landmarks, where it lies in odom, and how far it finds the odometry off.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "vip_slam_core/types/map_update.h"
#include "vip_slam_frontend/tracking/landmark_matcher.h"

namespace vip_slam::frontend {

class MapLink {
 public:
  MapLink(const TrackingOptions& options, std::shared_ptr<const CameraModel> camera)
      : landmarks_(options, std::move(camera)) {}

  /// `epoch`: the odometry's present one.
  void apply(const MapUpdate& update, std::uint32_t epoch) {
    landmarks_.apply(update);
    // T_map_odom of another epoch, or of a map without keyframes, is not valid for this odometry.
    T_map_odom_.reset();
    if (update.epoch == epoch && update.newest_keyframe != 0) T_map_odom_ = update.T_map_odom;
    if (std::isfinite(update.odometry_variance)) odometry_variance_ = std::max(1.0, update.odometry_variance);
  }
  /// A track that has ended: its patch may be recognised later.
  void retire(const Track& track) { landmarks_.retire(track); }
  /// Adds tracks of landmarks in view of the camera at T_odom_C; their number.
  int reacquire(FeatureTracker* tracker, const OrbExtractor& orb, const SE3& T_odom_C) const {
    return T_map_odom_ ? landmarks_.reacquire(tracker, orb, *T_map_odom_ * T_odom_C, T_odom_C) : 0;
  }
  /// Factor on the covariance of the filter, by which the map finds its motions wrong.
  double odometryVariance() const { return odometry_variance_; }
  /// The back end has discarded its map.
  void forgetMap() {
    landmarks_.clear();
    odometry_variance_ = 1;
  }
  /// A new epoch.
  void reset() {
    landmarks_.forgetPatches();
    T_map_odom_.reset();
  }

 private:
  LandmarkMatcher landmarks_;
  double odometry_variance_ = 1;
  std::optional<SE3> T_map_odom_;  ///< empty: not known in this epoch
};

}  // namespace vip_slam::frontend
