// SPDX-License-Identifier: BSD-3-Clause
// The map of the back end. One owner thread; others get snapshots. Every operation keeps the invariants that
// checkMap() (map_checker.h) states, or throws MapError and changes nothing.
#pragma once

#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "vip_slam_backend/map/map_types.h"
#include "vip_slam_core/types/landmark_aliases.h"

namespace vip_slam {

/// What changed since the last takeChanges(), for the next MapUpdate.
struct MapChanges {
  std::vector<KeyframeId> removed_keyframes;
  std::vector<LandmarkId> removed_landmarks;
  std::vector<std::pair<LandmarkId, LandmarkId>> merged_landmarks;  ///< (from, into)
};

class Map {
 public:
  // ---- keyframes ----
  /// Inserts a keyframe at the end of the IMU chain. Refused: what validateKeyframe() refuses, an id not above all
  /// others or too far from the first one, a state that is not finite, a stamp or IMU samples before the previous
  /// keyframe's end. IMU samples that do not tell the whole motion since then make no factor.
  MapKeyframe& addKeyframe(const KeyframePtr& data, const NavState& state, const ImuNoise& noise);
  /// Inserts a keyframe of a stored map: any id not taken; the chain is given by `previous`, an earlier keyframe of the
  /// same odometry.
  MapKeyframe& restoreKeyframe(const KeyframePtr& data, const NavState& state, KeyframeId previous,
                               const std::vector<ImuSample>& imu, const ImuNoise& noise);
  /// Sets newly estimated camera-IMU extrinsics in all keyframes but those of a stored map. The camera poses stay, so
  /// that landmarks and planes fit as before; the body poses change.
  void adoptExtrinsics(const SE3& T_I_C);
  /// Applies a newly estimated correction of depth and intrinsics to features, depth grids and depth points on planes
  /// of all keyframes but those of a stored map. Landmarks, planes and poses follow with the next optimisation.
  void adoptCameraCorrection(const CameraCorrection& correction);
  /// Applies a newly estimated gyro correction: the IMU factors of all keyframes but those of a stored map are
  /// integrated again.
  void adoptGyroCorrection(const Eigen::Matrix3d& correction, const ImuNoise& noise);
  /// Whether the links of the chain before and after a keyframe can become one without it: both with IMU samples, or,
  /// without any IMU, both by the odometry's motion.
  bool joinable(const MapKeyframe& keyframe) const;
  /// How long that link would be, seconds.
  double joinedSeconds(const MapKeyframe& keyframe) const;
  /// Removes it with its observations; landmarks left without observation go too. The chain is joined over the gap
  /// when that is possible and the joined link stays below `max_imu_seconds`, else it is cut.
  void removeKeyframe(KeyframeId id, const ImuNoise& noise, double max_imu_seconds);

  bool hasKeyframe(KeyframeId id) const { return keyframes_.count(id) != 0; }
  MapKeyframe& keyframe(KeyframeId id);  ///< throws MapError when there is none
  const MapKeyframe& keyframe(KeyframeId id) const;
  const std::map<KeyframeId, MapKeyframe>& keyframes() const { return keyframes_; }
  KeyframeId newestKeyframe() const { return keyframes_.empty() ? 0 : keyframes_.rbegin()->first; }
  /// Keyframes that share landmarks with `id`, most shared first (ties: newer first).
  std::vector<std::pair<KeyframeId, int>> covisible(KeyframeId id, int min_shared = 1) const;
  /// Sets the state. Integrates the IMU again when the biases have changed too much.
  void setState(KeyframeId id, const NavState& state, const ImuNoise& noise);

  // ---- landmarks ----
  /// A new landmark with its first observation. Refused: id taken, position not finite, feature taken or unknown.
  MapLandmark& addLandmark(LandmarkId id, const Eigen::Vector3d& p_W, const MapObservation& first);
  /// Inserts a landmark of a stored map with all its observations. Refused for the same reasons as the single steps.
  MapLandmark& restoreLandmark(const MapLandmark& stored);
  /// False when that feature has a landmark already or that keyframe sees this landmark already.
  bool addObservation(LandmarkId id, const MapObservation& observation);
  /// The landmark is removed with its last observation.
  void removeObservation(LandmarkId id, KeyframeId keyframe);
  void removeLandmark(LandmarkId id);
  /// Moves the observations of `from` to `into`. False (nothing done) when both are seen by one keyframe in different
  /// features, or they are the same.
  bool mergeLandmarks(LandmarkId from, LandmarkId into);
  /// Follows merges: the id under which a track is known now; the id itself when it was never merged.
  LandmarkId resolve(LandmarkId id) const { return aliases_.resolve(id); }

  bool hasLandmark(LandmarkId id) const { return landmarks_.count(id) != 0; }
  MapLandmark& landmark(LandmarkId id);  ///< throws MapError when there is none
  const MapLandmark& landmark(LandmarkId id) const;
  const MapLandmark* findLandmark(LandmarkId id) const;
  const std::unordered_map<LandmarkId, MapLandmark>& landmarks() const { return landmarks_; }
  std::vector<LandmarkId> landmarkIds() const;  ///< ascending
  void setPosition(LandmarkId id, const Eigen::Vector3d& p_W);
  const Feature& feature(const MapObservation& o) const { return keyframe(o.keyframe).features()[o.feature]; }

  // ---- planes ----
  /// Adds or updates; keeps the map's plane parameters when they have been optimised already.
  void setPlane(const PlaneEstimate& estimate);
  void setPlaneParameters(PlaneId id, const Plane& plane);
  /// How far points of a plane lie beside it; `variance` > 0, m^2.
  void setSurfaceVariance(PlaneId id, double variance);
  /// Moves the plane by `motion`, new from old world, as the keyframes that see it were moved.
  void movePlane(PlaneId id, const SE3& motion);
  /// `from` becomes part of `into`, with its observations and landmarks; nothing when `from` is unknown.
  void mergePlanes(PlaneId from, PlaneId into);
  void removePlane(PlaneId id);
  bool hasPlane(PlaneId id) const { return planes_.count(id) != 0; }
  const std::map<PlaneId, MapPlane>& planes() const { return planes_; }
  /// Replaces the observation of the same keyframe and plane; one without points removes it. Ignored (false) when
  /// keyframe or plane do not exist, or validateObservation() finds fault with it.
  bool setPlaneObservation(const PlaneObservation& observation);
  /// 0 removes the association.
  void associate(LandmarkId landmark, PlaneId plane);

  // ---- all ----
  /// Moves keyframes to new poses (loop correction): velocities rotate with them, each landmark follows its host.
  void moveKeyframes(const std::map<KeyframeId, SE3>& T_W_I);
  /// Multiplies the noise of the IMU factor into a keyframe by `factor`.
  void widenImuNoise(KeyframeId id, double factor, const ImuNoise& noise);
  /// Multiplies the covariance of the odometry's motion into a keyframe by `factor`.
  void widenMotion(KeyframeId id, double factor);
  MapChanges takeChanges();
  void clear();
  bool empty() const { return keyframes_.empty(); }

 private:
  MapKeyframe& insert(const KeyframePtr& data, const NavState& state, KeyframeId previous,
                      const std::shared_ptr<const std::vector<ImuSample>>& imu, const ImuNoise& noise);
  /// Joins the IMU chain over a keyframe that is to be removed, or cuts it.
  void joinOver(const MapKeyframe& keyframe, const ImuNoise& noise, double max_imu_seconds);
  void updateDescriptor(MapLandmark& landmark);
  /// Forgets those of tracks that no keyframe contains any more.
  void forgetAliases();

  std::map<KeyframeId, MapKeyframe> keyframes_;
  std::unordered_map<LandmarkId, MapLandmark> landmarks_;
  LandmarkAliases aliases_;
  std::map<PlaneId, MapPlane> planes_;
  MapChanges changes_;
};

/// Empty when the keyframe may enter a map, else the reason ("keyframe 7: feature 12 is not finite").
std::string validateKeyframe(const Keyframe& keyframe);
/// The same for a plane's observation; whether keyframe and plane exist is not looked at.
std::string validateObservation(const PlaneObservation& observation);

}  // namespace vip_slam
