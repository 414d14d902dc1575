// State of the back end, shared by the files that implement its parts.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

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

  // back_end.cpp
  /// Inserts at the predicted pose and looks for known landmarks; throws MapError when refused.
  void insert(const KeyframePtr& keyframe);
  MapUpdate addKeyframe(const KeyframePtr& keyframe);
  void refuseUntoldRestart(const Keyframe& keyframe);
  /// Localisation only: what there is of a map stays as it is.
  bool frozen() const { return localisation_only && !map.empty(); }
  void applyPlaneUpdate(const PlaneUpdate& update);
  void removeUnnamedPlanes(const PlaneUpdate& update);
  void applyHeldUpdates();
  MapSnapshot snapshot() const;
  void reset();

  // back_end_calibration.cpp
  /// All keyframes of this session get the same correction of their depth: the newest one's, once it is another one by
  /// enough to redo the map for.
  void followCameraCorrection(const CameraCorrection& newest);
  /// Asks the map what the depth camera reads wrong at which distance; when that is something new all keyframes have
  /// it. False when nothing is new.
  bool learnDepthCurve();
  void followGyroCorrection(const Eigen::Matrix3d& newest);

  // back_end_steps.cpp
  /// Pose of the keyframe in the map as T_map_odom predicts it; starts a new epoch where the odometry did.
  NavState predict(const Keyframe& keyframe);
  /// Optimises the window; ids of keyframes, landmarks and planes that changed go to `update`.
  void localBundleAdjustment(double t, MapUpdate* update);
  void cull(MapUpdate* update);
  /// T_map_odom from the newest keyframe.
  void followNewest();
  /// Whether the map tells where the present epoch of the odometry lies in it; else T_map_odom is a guess.
  bool placed() const;
  MapUpdate beginUpdate(double t) const;
  /// Fills estimates of everything (global) and what was removed and merged since the last update.
  void fillGlobal(MapUpdate* update) const;
  void finishUpdate(MapUpdate* update);
  KeyframeEstimate estimateOf(const MapKeyframe& kf) const;
  LandmarkEstimate estimateOf(const MapLandmark& landmark) const;
  void askForScale();
  GbaJob makeGlobalJob() const;
  /// False when the map stays as it was: the solution is of no use, or of a map that is no more.
  bool takeGlobal(const GbaResult& result);
  /// With everything in it when the map `moved`.
  MapUpdate globalUpdate(bool moved);

  // back_end_maps.cpp
  void saveMap(const std::string& path) const;
  MapUpdate loadMap(const std::string& path);
  std::vector<StoredPlane> storedPlanes() const;
  /// The keyframes that another one may be found at.
  std::function<bool(KeyframeId)> inReferencePart() const;
  bool findInMap(const KeyframePtr& keyframe, Relocalisation* found);
  /// Recognises the loaded map; on success the keyframe and those held before it enter it.
  bool enterLoadedMap(const KeyframePtr& keyframe);
  /// Localisation only: T_map_odom follows, the map stays.
  void localise(const KeyframePtr& keyframe);
  /// The first keyframe that is mapped after localisation only: its odometry's place in the map is known.
  /// Localisation has found the odometry of this keyframe in the map, just before.
  bool knowsWhereItWasFound(const Keyframe& keyframe);
  /// What an odometry has mapped at a guess, before it was found, comes along; true when there was anything.
  bool bringToWhereItWasFound(std::uint32_t epoch);
  void tieToLastFound(const KeyframePtr& keyframe);

  // back_end_loops.cpp
  void remember(const LoopEvent& event);
  /// Enters the newest keyframe into the place database and closes a loop there when there is one.
  void closeLoop(MapUpdate* update);

  BackEndOptions options;
  SensorConfig sensor;
  TimingLog* log = nullptr;
  std::shared_ptr<const CameraModel> camera;
  BuilderSettings settings;
  Map map;
  LandmarkMaker maker;
  Reobservation reobservation;
  std::unique_ptr<BaSolver> solver;
  LoopCloser loop_closer;
  Relocaliser relocaliser;
  std::optional<std::uint32_t> restarted_epoch;  ///< of an odometry that bears the number of an old one
  bool searching = false;                        ///< a loaded map is not recognised yet
  bool localisation_only = false;
  std::vector<PlaneUpdate> held_updates;  ///< that came since
  std::deque<KeyframePtr> held;           ///< keyframes that wait for that
  std::vector<Anchor> localised;          ///< keyframes found in the map without entering it

  /// Localisation only: the last keyframe found in the map, to which the odometry is tied when mapping goes on.
  struct LastFound {
    std::uint32_t epoch = 0;
    KeyframeId match = 0;
    double t = 0;
  };
  std::optional<LastFound> last_found;
  std::uint64_t loads = 0;  ///< of maps, since the start

  SE3 T_map_odom;
  std::uint32_t epoch = 0;
  std::uint64_t revision = 0;
  std::uint64_t first_revision = 0;  ///< of the map as it is since the last reset; older ones speak of another
  /// Counts loop corrections, loaded maps and resets: a global adjustment of the map before one must not undo it.
  std::uint64_t correction = 0;
  bool global_wanted = false;
  double last_global = -1e300;                                ///< stamp of the last one that a loop asked for
  CameraCorrection camera_correction;                         ///< of all keyframes of this session
  double newest_depth_offset = 0;                             ///< m, as the newest keyframe came
  BearingCorrection newest_bearing;                           ///< likewise
  DepthShift newest_depth_shift;                              ///< likewise
  double disparity_error = 0;                                 ///< 1/m, which the curve takes care of
  Eigen::Matrix3d gyro_correction = Eigen::Matrix3d::Zero();  ///< of all keyframes of this session but for little
  Eigen::Matrix3d newest_gyro_correction = Eigen::Matrix3d::Zero();  ///< as the newest keyframe came
  std::string refusal;
  std::vector<LoopEvent> loops;      ///< all accepted so far, and the newest that were refused
  std::size_t rejected_kept = 0;     ///< of these
  std::vector<LoopEvent> new_loops;  ///< since the last update
  BackEndStatistics statistics;
};

}  // namespace vip_slam
