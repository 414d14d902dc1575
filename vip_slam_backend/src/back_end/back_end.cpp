// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/back_end.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "../optimisation/imu_agreement.h"
#include "back_end_impl.h"
#include "vip_slam_backend/optimisation/depth_curve_fit.h"
#include "vip_slam_backend/optimisation/disparity_fit.h"
#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam {
namespace {

constexpr std::uint64_t kLearnInterval = 20;  // keyframes

}  // namespace

BackEnd::Impl::Impl(const BackEndOptions& o, const SensorConfig& s, TimingLog* l)
    : Impl(o, s, makeCamera(s.camera), l) {}

BackEnd::Impl::Impl(const BackEndOptions& o, const SensorConfig& s, const std::shared_ptr<const CameraModel>& camera,
                    TimingLog* l)
    : options(o),
      sensor(s),
      log(l),
      maker(camera->focal()),
      reobservation(o.reobservation, camera),
      solver(makeSolver(o.solver)),
      loop_closer(o.loop, camera, l),
      relocaliser(o.loop.relocalisation) {
  settings.variant = variantFromName(o.variant);
  settings.measurement = o.measurement;
  settings.focal = camera->focal();
  settings.depth_noise = s.depth_noise;
  settings.gravity = gravityVector(s.gravity);
}

void BackEnd::Impl::insert(const KeyframePtr& keyframe) {
  const double t = keyframe->frame.t;
  const backend::OdometryInMap before = odometry;
  const NavState state = odometry.predict(*keyframe, map);
  try {
    map.addKeyframe(withCameraCorrection(keyframe, calibration.camera()), state, sensor.imu_noise);
  } catch (...) {
    odometry = before;
    throw;
  }
  const MapKeyframe& inserted = map.keyframe(keyframe->id);
  noteWeakness(inserted);
  map.widenMotion(keyframe->id, odometry_noise.varianceFactor());
  if (inserted.previous != 0) {
    const double factor = imuNoiseFactor(map.keyframe(inserted.previous), inserted, settings.gravity);
    if (factor > 1) map.widenImuNoise(keyframe->id, factor, sensor.imu_noise);
  }
  // New extrinsics change the body poses outside the local window as well. These are published with the next global
  // update; until then the published camera poses are still right.
  map.adoptExtrinsics(keyframe->frame.T_I_C);
  // An adjustment under way has the old readings.
  if (calibration.follow(keyframe->frame.camera_correction, report.statistics.keyframes_received, &map))
    global.startOver();
  if (calibration.followGyro(keyframe->gyro_correction, report.statistics.keyframes_received, sensor.imu_noise, &map))
    global.startOver();
  const ScopedTimer reobserve_timer(log, "backend.reobserve", t);
  // The place of a new odometry in the map is a guess until a loop ties it: its landmarks must not be matched with
  // older ones by chance.
  const std::set<KeyframeId> part = connectedKeyframes(map, keyframe->id, loop_closer.loops());
  const auto in_part = [&part](KeyframeId id) { return part.count(id) != 0; };
  maker.process(keyframe->id, &map, in_part);
  const ReobservationResult found = reobservation.process(keyframe->id, &map, in_part);
  report.statistics.reobserved += found.found;
  report.statistics.merged += found.merged;
}

void BackEnd::Impl::noteWeakness(const MapKeyframe& inserted) {
  const Keyframe& data = *inserted.data;
  if (data.frame.features.empty())
    report.notices.add("keyframe " + std::to_string(data.id) + ": without features: only its neighbours hold it");
  const bool whole_imu = sensor.hasGyro() && sensor.hasAccel();
  if (whole_imu && data.previous != 0 && !inserted.preintegration) ++report.statistics.without_imu;
}

MapUpdate BackEnd::Impl::addKeyframe(const KeyframePtr& keyframe) {
  report.refusal.clear();
  ++report.statistics.keyframes_received;
  const double t = keyframe ? keyframe->frame.t : 0.0;
  const ScopedTimer timer(log, "backend.keyframe", t);
  MapUpdate update = beginUpdate(t);
  const CameraCorrection camera_before = calibration.camera();
  bool entering = false, brought = false;
  try {
    if (!keyframe) throw MapError("no keyframe given");
    const std::string bad = validateKeyframe(*keyframe);
    if (!bad.empty()) throw MapError(bad);
    // Mapping it would create a map of this single keyframe, to localise in from then on.
    if (localisation.only && map.empty()) throw MapError("localisation without a map: load one, or go on mapping");
    if (keyframe->id <= map.newestKeyframe())
      throw MapError("keyframe " + std::to_string(keyframe->id) + " is not newer than keyframe " +
                     std::to_string(map.newestKeyframe()) + " of the map");
    if (frozen()) {
      localise(keyframe);
      finishUpdate(&update);
      if (!localisation.searching) {  // keyframes that waited for the map to be recognised will not be mapped any more
        for (const KeyframePtr& waiting : localisation.held) update.removed_keyframes.push_back(waiting->id);
        localisation.held.clear();
      }
      update.removed_keyframes.push_back(keyframe->id);  // it will never be in the map
      return update;
    }
    entering = localisation.searching;
    if (localisation.searching && !enterLoadedMap(keyframe)) {
      finishUpdate(&update);
      return update;
    }
    if (!map.hasKeyframe(keyframe->id)) {
      const bool found = hasRecentLocalisation(*keyframe);
      brought = found && moveUnplacedPartToMap(keyframe->frame.epoch);
      insert(keyframe);
      if (found) tieToLastFound(keyframe);
    }
  } catch (const MapError& e) {
    report.refused(e.what());
    finishUpdate(&update);
    // Report it as removed, since other modules wait for it; not when the map has a keyframe with this id.
    const auto waits = [&keyframe](const KeyframePtr& other) { return other->id == keyframe->id; };
    if (keyframe && !map.hasKeyframe(keyframe->id) &&
        std::none_of(localisation.held.begin(), localisation.held.end(), waits))
      update.removed_keyframes.push_back(keyframe->id);
    return update;
  }
  localBundleAdjustment(t, &update);
  cull(&update);
  closeLoop(&update);
  if (report.statistics.keyframes_received % kLearnInterval == 0) {
    askForScale();
    if (learnDepthCurve()) global.want();
  }
  // Poses of keyframes that waited or were moved, and corrected depth, are new to all receivers: update everything.
  if (entering || brought || calibration.camera() != camera_before) fillGlobal(&update);
  finishUpdate(&update);
  return update;
}

MapSnapshot BackEnd::Impl::snapshot() const {
  MapSnapshot snapshot;
  snapshot.revision = numbers.revision();
  snapshot.epoch = odometry.epoch();
  snapshot.T_map_odom = odometry.T_map_odom();
  const auto placed = inReferencePart();
  for (const auto& entry : map.keyframes()) {
    const MapKeyframe& kf = entry.second;
    SnapshotKeyframe out;
    out.stored = kf.stored;
    out.placed = placed(entry.first);
    out.id = entry.first;
    out.t = kf.data->frame.t;
    out.epoch = kf.data->frame.epoch;
    out.state = kf.state;
    out.T_chain_C = kf.data->frame.T_chain_C;
    out.T_I_C = kf.T_I_C;
    for (const LandmarkId landmark : kf.landmarks) out.landmarks += landmark != kNoLandmark;
    snapshot.keyframes.push_back(out);
  }
  for (const LandmarkId id : map.landmarkIds()) snapshot.landmarks.push_back(estimateOf(map.landmark(id)));
  for (const auto& entry : map.planes()) snapshot.planes.push_back(entry.second.estimate);
  snapshot.loops = report.loops.kept();
  snapshot.localised = localisation.localised;
  snapshot.statistics = report.statistics;
  snapshot.statistics.odometry_variance = odometry_noise.varianceFactor();
  for (const LandmarkEstimate& landmark : snapshot.landmarks)
    snapshot.statistics.plane_landmarks += landmark.plane != 0;
  return snapshot;
}

void BackEnd::Impl::reset() {
  map.clear();
  maker.clear();
  odometry_noise.reset();
  loop_closer.clear();
  localisation.reset();
  relocaliser.clear();
  solver = makeSolver(options.solver);
  odometry = backend::OdometryInMap();
  numbers.startMap();
  global.reset();
  calibration.reset();
  report = backend::Report();
}

BackEnd::BackEnd(const BackEndOptions& options, const SensorConfig& sensor, TimingLog* log)
    : impl_(std::make_unique<Impl>(options, sensor, log)) {}
BackEnd::~BackEnd() = default;

MapUpdate BackEnd::addKeyframe(KeyframePtr keyframe) { return impl_->addKeyframe(keyframe); }
const std::string& BackEnd::lastRefusal() const { return impl_->report.refusal; }
std::vector<std::string> BackEnd::takeRefusals() { return impl_->report.refusals.take(); }
std::vector<std::string> BackEnd::takeNotices() { return impl_->report.notices.take(); }
void BackEnd::applyPlaneUpdate(const PlaneUpdate& update) { impl_->applyPlaneUpdate(update); }
bool BackEnd::globalBaWanted() const { return impl_->global.wanted() && !impl_->frozen(); }
void BackEnd::requestGlobalBa() { impl_->global.want(); }

GbaJob BackEnd::startGlobalBa() {
  impl_->global.start();
  impl_->calibration.adoptNewest(impl_->sensor.imu_noise, &impl_->map);
  return impl_->makeGlobalJob();
}

GbaResult BackEnd::run(const GbaJob& job) const {
  GbaResult result;
  result.correction = job.correction;
  if (!job.problem) return result;
  const ScopedTimer timer(impl_->log, "backend.gba", job.problem->t);
  result.solution = std::make_shared<const GlobalBaSolution>(solveGlobalBa(*job.problem));
  return result;
}

MapUpdate BackEnd::merge(const GbaResult& result) { return impl_->globalUpdate(impl_->takeGlobal(result)); }

std::optional<MapUpdate> BackEnd::mapWaiting() {
  if (!impl_->mapHeld()) return std::nullopt;
  return impl_->globalUpdate(true);
}

MapUpdate BackEnd::finish() {
  if (!impl_->options.global_ba.at_end || impl_->frozen()) return impl_->globalUpdate(false);
  bool moved = impl_->takeGlobal(run(startGlobalBa()));
  if (impl_->learnDepthCurve()) moved = impl_->takeGlobal(run(startGlobalBa())) || moved;
  return impl_->globalUpdate(moved);
}

InertialScale BackEnd::scale() const { return impl_->report.statistics.scale; }
const DepthCurve& BackEnd::depthCurve() const { return impl_->calibration.camera().curve; }
double BackEnd::disparityError() const { return impl_->calibration.disparityError(); }
std::string BackEnd::depthDifference() const {
  if (disparityError() != 0) return disparityDifference(disparityError());
  return depthCurveDifference(depthCurve());
}
MapSnapshot BackEnd::snapshot() const { return impl_->snapshot(); }
const Map& BackEnd::map() const { return impl_->map; }
void BackEnd::reset() { impl_->reset(); }
void BackEnd::saveMap(const std::string& path) const { impl_->saveMap(path); }
std::vector<StoredPlane> BackEnd::storedPlanes() const { return impl_->storedPlanes(); }
MapUpdate BackEnd::loadMap(const std::string& path) { return impl_->loadMap(path); }
void BackEnd::setLocalisationMode(bool on) {
  impl_->localisation.only = on;
  if (!on) impl_->applyHeldUpdates();
}

}  // namespace vip_slam
