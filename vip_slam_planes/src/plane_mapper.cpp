#include "vip_slam_planes/plane_mapper.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "plane_mapper_impl.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/types/camera_correction.h"
#include "vip_slam_planes/growth/other_layers.h"
#include "vip_slam_planes/growth/see_through.h"
#include "vip_slam_planes/growth/triangle_association.h"

namespace vip_slam {
namespace {

const CameraModel& checked(const std::shared_ptr<const CameraModel>& camera, const DepthNoise& noise) {
  if (!camera) throw std::invalid_argument("plane mapper: the camera model is missing");
  const std::string fault = noise.validate();
  if (!fault.empty()) throw std::invalid_argument("plane mapper: depth noise: " + fault);
  return *camera;
}

bool isSound(const CameraCorrection& correction) { return validateCameraCorrection(correction).empty(); }

bool isSound(const DepthGrid& grid) {
  if (grid.cols < 0 || grid.rows < 0 || grid.z.size() != std::size_t(grid.cols) * std::size_t(grid.rows)) return false;
  return grid.empty() || grid.stride > 0;
}

bool isFinite(const PlanePolygon& polygon) {
  const auto finite = [](const Ring& ring) {
    return std::all_of(ring.begin(), ring.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
  };
  return finite(polygon.outer) && std::all_of(polygon.holes.begin(), polygon.holes.end(), finite);
}

}  // namespace

bool isSound(const KeyframeEstimate& estimate) {
  return estimate.state.T_W_I.isFinite() && estimate.T_I_C.isFinite() && isSound(estimate.camera_correction);
}

bool isSound(const Plane& plane) {
  return plane.n.allFinite() && std::isfinite(plane.d) && std::abs(plane.n.norm() - 1) < 1e-3;
}

PlaneMapper::Impl::Impl(const PlaneMapperOptions& o, std::shared_ptr<const CameraModel> c, const DepthNoise& n,
                        TimingLog* t)
    : options(o),
      camera(c),
      noise(n),
      timing(t),
      mesher_(o.mesh, c, n),
      rays_(c),
      sampler_(o.observation, o.growth.distance, n),
      points_(o.association, checked(c, n).focal(), n.bias_floor),
      evidence_(o.detection, o.growth),
      strips_(o.detection, o.growth) {}

std::vector<PlaneTrack*> PlaneMapper::Impl::tracksInView(const SE3& T_map_C, std::uint32_t epoch) {
  std::vector<PlaneTrack*> tracks;
  // Planes may also grow into view: the range is larger by the growth gap.
  for (auto& [id, track] : tracks_) {
    if (!epochs_.tied(track.epoch, epoch)) continue;
    if (mayBeInView(track, T_map_C, noise.max_range + options.growth.gap)) tracks.push_back(&track);
  }
  return tracks;
}

const CameraPoses& PlaneMapper::Impl::posesTiedTo(std::uint32_t epoch) {
  if (epochs_.allTied()) return poses_;
  tied_poses_.clear();
  for (const auto& [id, keyframe] : placed_) {
    if (epochs_.tied(keyframe->frame.epoch, epoch)) tied_poses_[id] = poses_.at(id);
  }
  return tied_poses_;
}

void PlaneMapper::Impl::grow(const TrackedFrame& frame, const SE3& T_map_odom) {
  const bool usable = frame.status.state == TrackingState::kTracking && !frame.depth_grid.empty() && newest_ != 0 &&
                      frame.epoch == epoch_ && !localising_ && !tracks_.empty() && isSound(frame.depth_grid) &&
                      isSound(frame.camera_correction);
  const SE3 T_map_C = T_map_odom * frame.state.T_W_I * frame.T_I_C;
  const SE3 moved = grown_at_.inverse() * T_map_C;
  const bool still = has_grown_ && moved.t().norm() < options.growth.min_move &&
                     logSO3(moved.rotation()).norm() < options.growth.min_turn_deg * kDegree;
  if (!usable || still || !T_map_C.isFinite()) {
    ++counters.frames_skipped;
    return;
  }
  const ScopedTimer timer(timing, "planes.grow", frame.t);
  ++counters.frames_grown;
  grown_at_ = T_map_C;
  has_grown_ = true;
  const std::vector<PlaneTrack*> tracks = tracksInView(T_map_C, frame.epoch);
  if (tracks.empty()) return;
  const DepthMesh& mesh =
      mesher_.build(frame.features, frame.depth_grid, T_map_C.R().row(2), frame.camera_correction.bearing);
  const std::vector<MapTriangle> triangles = placeMesh(mesh, T_map_C);
  std::vector<int> label = associateTriangles(triangles, {tracks.begin(), tracks.end()}, options.growth);
  releaseOtherLayers(triangles, {tracks.begin(), tracks.end()}, &label);
  const auto host_pose = poses_.find(frame.keyframe);
  const KeyframeId host = host_pose == poses_.end() ? newest_ : frame.keyframe;
  std::vector<double> area(tracks.size(), 0);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (label[i] < 0) continue;
    tracks[label[i]]->cover(triangles[i], host, poses_.at(host), nullptr);
    area[label[i]] += triangles[i].area;
  }
  // Frames from other places confirm a plane that one keyframe has started, as a second keyframe would.
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    PlaneTrack& track = *tracks[k];
    if (track.confirmed || track.keyframes_seen == 0 || area[k] < options.support.min_area) continue;
    if ((T_map_C.t() - track.viewed_from).norm() < options.support.view_distance) continue;
    track.viewed_from = T_map_C.t();
    track.confirmed = ++track.views_seen >= options.support.min_views;
  }
}

void PlaneMapper::Impl::clear() {
  waiting_.clear();
  placed_.clear();
  poses_.clear();
  epoch_of_.clear();
  tied_poses_.clear();
  epochs_.clear();
  tracks_.clear();
  points_.clear();
  evidence_.clear();
  strips_.clear();
  open_gaps_.clear();
  published.clear();
  merges_.clear();
  removed_.clear();
  fresh_.clear();
  withdrawn_.clear();
  next_plane_ = 1;
  newest_ = stored_until_ = 0;
  has_grown_ = came_together_ = localising_ = false;
}

void PlaneMapper::Impl::restore(const std::vector<StoredPlane>& planes, KeyframeId newest_keyframe) {
  clear();
  stored_until_ = newest_keyframe;
  for (const auto& [estimate, host] : planes) {
    next_plane_ = std::max(next_plane_, estimate.id + 1);
    const bool sound = !estimate.polygons.empty() && !estimate.polygons.front().outer.empty() &&
                       std::all_of(estimate.polygons.begin(), estimate.polygons.end(), isFinite) &&
                       isSound(estimate.plane) && estimate.kind <= PlaneKind::kGeneral && host.T_map_C.isFinite() &&
                       !tracks_.count(estimate.id);
    if (!sound) {
      if (!tracks_.count(estimate.id)) removed_.push_back(estimate.id);
      continue;
    }
    PlaneTrack track(estimate.id, estimate.kind, estimate.plane, estimate.polygons.front().outer.front(),
                     options.growth.cell);
    for (const PlanePolygon& polygon : estimate.polygons) {
      Ring2d outer;
      for (const Eigen::Vector3d& p : polygon.outer) outer.push_back(track.toPlane(p));
      std::vector<Ring2d> holes(polygon.holes.size());
      for (std::size_t i = 0; i < holes.size(); ++i) {
        for (const Eigen::Vector3d& p : polygon.holes[i]) holes[i].push_back(track.toPlane(p));
      }
      track.coverPolygon(outer, holes, options.growth.min_hits, host);
    }
    track.stored = true;
    track.epoch = host.epoch;
    epochs_.add(host.epoch);
    if (host.keyframe != 0) poses_[host.keyframe] = host.T_map_C, epoch_of_[host.keyframe] = host.epoch;
    track.confirmed = track.determined = true;
    track.keyframes_seen = static_cast<int>(estimate.keyframes);
    tracks_.emplace(estimate.id, std::move(track));
    published.push_back(estimate);
  }
}

void PlaneMapper::Impl::addKeyframe(const KeyframePtr& keyframe) {
  // A keyframe that was in transit when the map was loaded has the id of a stored one, which it would replace.
  if (!keyframe || keyframe->id <= stored_until_ || placed_.count(keyframe->id)) return;
  if (!isSound(keyframe->frame.depth_grid) || !isSound(keyframe->frame.camera_correction)) return;
  waiting_.emplace(keyframe->id, keyframe);
  // One more than the back end holds: the newest one, which it may still place.
  while (waiting_.size() > kMaxWaitingKeyframes + 1) {
    waiting_.erase(waiting_.begin());
    ++counters.keyframes_forgotten;
  }
  counters.keyframes_waiting = waiting_.size();
}

PlaneMapper::PlaneMapper(const PlaneMapperOptions& options, std::shared_ptr<const CameraModel> camera,
                         const DepthNoise& noise, TimingLog* timing)
    : impl_(new Impl(options, std::move(camera), noise, timing)) {}
PlaneMapper::~PlaneMapper() = default;

void PlaneMapper::addKeyframe(KeyframePtr keyframe) { impl_->addKeyframe(keyframe); }
void PlaneMapper::grow(const TrackedFrame& frame, const SE3& T_map_odom) { impl_->grow(frame, T_map_odom); }
PlaneUpdate PlaneMapper::applyMapUpdate(const MapUpdate& update) { return impl_->applyMapUpdate(update); }
const std::vector<PlaneEstimate>& PlaneMapper::planes() const { return impl_->published; }
void PlaneMapper::restore(const std::vector<StoredPlane>& planes, KeyframeId newest_keyframe) {
  impl_->restore(planes, newest_keyframe);
}
void PlaneMapper::clear() { impl_->clear(); }
const PlaneMapperCounters& PlaneMapper::counters() const { return impl_->counters; }

}  // namespace vip_slam
