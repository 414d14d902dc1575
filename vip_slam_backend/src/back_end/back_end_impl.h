// SPDX-License-Identifier: BSD-3-Clause
// State of the back end, shared by the files that implement its parts.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "../optimisation/odometry_noise.h"
#include "adjustment_requests.h"
#include "adopted_calibration.h"
#include "localisation.h"
#include "map_numbers.h"
#include "odometry_in_map.h"
#include "report.h"
#include "vip_slam_backend/back_end.h"
#include "vip_slam_backend/loop/graph_builder.h"
#include "vip_slam_backend/loop/loop_closer.h"
#include "vip_slam_backend/loop/loop_fusion.h"
#include "vip_slam_backend/map/culling.h"
#include "vip_slam_backend/map/landmark_maker.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map/reobservation.h"
#include "vip_slam_backend/optimisation/global_ba.h"
#include "vip_slam_backend/optimisation/problem_builder.h"
#include "vip_slam_backend/relocalisation/relocaliser.h"
#include "vip_slam_backend/solver/ba_solver.h"

namespace vip_slam {

struct BackEnd::Impl {
  Impl(const BackEndOptions& options, const SensorConfig& sensor, TimingLog* log);
  Impl(const BackEndOptions& options, const SensorConfig& sensor, const std::shared_ptr<const CameraModel>& camera,
       TimingLog* log);

  // back_end.cpp
  /// Inserts at the predicted pose and re-observes known landmarks; throws MapError when refused.
  void insert(const KeyframePtr& keyframe);
  MapUpdate addKeyframe(const KeyframePtr& keyframe);
  /// Notices what holds a keyframe less than usual.
  void noteWeakness(const MapKeyframe& inserted);
  /// Localisation-only mode with a map, which must not change.
  bool frozen() const { return localisation.only && !map.empty(); }
  void applyPlaneUpdate(const PlaneUpdate& update);
  void removeUnnamedPlanes(const PlaneUpdate& update);
  void applyHeldUpdates();
  MapSnapshot snapshot() const;
  void reset();

  /// Learns the depth camera's error over the distance, and tells an adjustment under way. False: nothing changed.
  bool learnDepthCurve();

  // back_end_steps.cpp
  /// Optimises the window; adds the keyframes, landmarks and planes that changed to `update`.
  void localBundleAdjustment(double t, MapUpdate* update);
  void cull(MapUpdate* update);
  /// Whether the place of the present odometry epoch in the map is known; else T_map_odom is a guess.
  bool placed() const;
  MapUpdate beginUpdate(double t) const;
  /// Fills estimates of everything (global) and what was removed and merged since the last update.
  void fillGlobal(MapUpdate* update) const;
  void finishUpdate(MapUpdate* update);
  KeyframeEstimate estimateOf(const MapKeyframe& kf) const;
  LandmarkEstimate estimateOf(const MapLandmark& landmark) const;
  void askForScale();
  GbaJob makeGlobalJob() const;
  /// Merges a solution into the map. False, the map unchanged, when the solution is unusable or outdated.
  bool takeGlobal(const GbaResult& result);
  /// An update with the whole map when it `moved`.
  MapUpdate globalUpdate(bool moved);

  // back_end_maps.cpp
  void saveMap(const std::string& path) const;
  MapUpdate loadMap(const std::string& path);
  std::vector<StoredPlane> storedPlanes() const;
  /// Predicate of the keyframes that others may be localised at.
  std::function<bool(KeyframeId)> inReferencePart() const;
  bool findInMap(const KeyframePtr& keyframe, Relocalisation* found);
  /// Relocalises in the loaded map; on success the keyframe and those held before it are inserted. When as many as may
  /// be held are, they are mapped without.
  bool enterLoadedMap(const KeyframePtr& keyframe);
  /// Makes what waits for the loaded map to be recognised a part of the map of its own, at a guessed place as after a
  /// restart of the odometry, which a loop may tie to the rest later. False when nothing waits.
  bool mapHeld();
  void insertHeld(const std::deque<KeyframePtr>& keyframes);
  /// Localisation-only mode: updates T_map_odom, leaves the map unchanged.
  void localise(const KeyframePtr& keyframe);
  /// Whether localisation-only mode has found the odometry of this keyframe in the map within the last seconds.
  bool hasRecentLocalisation(const Keyframe& keyframe);
  /// Moves what the odometry had mapped at a guessed place to where it was found; false when there was nothing to move.
  bool moveUnplacedPartToMap(std::uint32_t epoch);
  /// The first keyframe that is mapped after localisation-only mode: ties its odometry to the last match in the map.
  void tieToLastFound(const KeyframePtr& keyframe);

  // back_end_loops.cpp
  /// Adds the newest keyframe to the place database and closes a loop there when there is one.
  void closeLoop(MapUpdate* update);

  BackEndOptions options;
  SensorConfig sensor;
  TimingLog* log = nullptr;
  BuilderSettings settings;
  Map map;
  LandmarkMaker maker;
  Reobservation reobservation;
  std::unique_ptr<BaSolver> solver;
  backend::OdometryNoise odometry_noise;
  LoopCloser loop_closer;
  Relocaliser relocaliser;
  Localisation localisation;
  backend::MapNumbers numbers;
  backend::OdometryInMap odometry;
  AdjustmentRequests global;
  backend::AdoptedCalibration calibration;
  backend::Report report;
};

}  // namespace vip_slam
