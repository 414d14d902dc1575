// SPDX-License-Identifier: BSD-3-Clause
// The keyframes of the plane mapper: those that wait for their place in `map`, those that have it, and the hosts of a
// loaded map's planes.
#pragma once

#include <map>
#include <set>
#include <unordered_set>
#include <vector>

#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_planes/epochs/epoch_groups.h"
#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

/// Pose, extrinsics and camera correction are usable.
bool isSound(const KeyframeEstimate& estimate);

class PlacedKeyframes {
 public:
  /// `stored_until`: keyframes up to here are those of a loaded map.
  explicit PlacedKeyframes(const DepthNoise& noise, KeyframeId stored_until = 0)
      : noise_(noise), stored_until_(stored_until) {}

  /// Keeps a keyframe that is not known until it is placed. Returns how many older ones had to be given up.
  std::size_t wait(const KeyframePtr& keyframe);
  /// Whether it is placed or, by its id, one of the loaded map.
  bool known(KeyframeId id) const { return id <= stored_until_ || placed_.count(id) > 0; }
  bool waits(KeyframeId id) const { return waiting_.count(id) > 0; }
  std::size_t waiting() const { return waiting_.size(); }
  /// Null when no keyframe with this id waits, or when the estimate is not sound. `same_place`: one sigma of a motion's
  /// displacement along a normal, m, beyond which surfaces across it before and after cannot be known again by their
  /// place.
  KeyframePtr place(const KeyframeEstimate& estimate, double same_place);
  /// The first keyframe after the last motion that was less sure than that along a plane's normal in `map`, 0 without
  /// one: what was seen before may lie elsewhere.
  KeyframeId sureSince(const Eigen::Vector3d& normal) const;
  /// Adds the keyframe that a loaded plane belongs to.
  void addHost(const PlaneHost& host);

  const std::map<KeyframeId, KeyframePtr>& placed() const { return placed_; }
  /// T_map_C of placed keyframes and of the hosts of loaded planes.
  const CameraPoses& poses() const { return poses_; }
  /// Keyframes, poses and depth noise as the comparison of planes needs them; refers to this object.
  PlaneViews views() const;
  /// Those of epochs that are tied to this one; valid until the next call.
  const CameraPoses& posesTiedTo(std::uint32_t epoch);
  void move(KeyframeId id, const SE3& T_map_C) { poses_.at(id) = T_map_C; }
  /// A placed keyframe's data with another camera correction.
  void replace(const KeyframePtr& corrected) { placed_.at(corrected->id) = corrected; }

  bool tied(std::uint32_t a, std::uint32_t b) const { return epochs_.tied(a, b); }
  /// True when epochs came together, or what was seen before and after an unsure motion did, by a loop across it.
  bool tie(const MapUpdate& update);

  KeyframeId newest() const { return newest_; }
  std::uint32_t newestEpoch() const { return epoch_; }
  /// One sigma of the gravity direction in the newest placed keyframe, radians, from the front end's covariance.
  double gravitySigma() const;

  void stopWaiting(KeyframeId id) { waiting_.erase(id); }
  /// Gives up waiting keyframes up to `newest` that are not named.
  void stopWaiting(const std::set<KeyframeId>& named, KeyframeId newest);
  /// Keyframes with a pose that are not named.
  std::vector<KeyframeId> unnamed(const std::set<KeyframeId>& named) const;
  bool hasPose(KeyframeId id) const { return epoch_of_.count(id) > 0; }
  /// The neighbour in time that moves nearly alike, since their epochs are tied; 0: none.
  KeyframeId heirOf(KeyframeId id) const;
  /// Forgets a keyframe with a pose; its data, null for a host.
  KeyframePtr remove(KeyframeId id);

  /// Tracks of all keyframes, waiting or placed.
  std::unordered_set<LandmarkId> tracks() const;

 private:
  DepthNoise noise_;
  std::map<KeyframeId, KeyframePtr> waiting_, placed_;
  CameraPoses poses_;
  std::map<KeyframeId, std::uint32_t> epoch_of_;  ///< of all that have a pose
  CameraPoses tied_poses_;                        ///< result of posesTiedTo() while not all epochs are tied
  EpochGroups epochs_;
  KeyframeId newest_ = 0;    ///< of the placed ones
  std::uint32_t epoch_ = 0;  ///< its epoch
  KeyframeId stored_until_ = 0;
  struct UnsureMotion {
    KeyframeId to;
    Eigen::Matrix3d covariance;  ///< of the displacement in `map`, in squares of what is sure enough
  };
  std::vector<UnsureMotion> unsure_;  ///< ascending
};

}  // namespace vip_slam
