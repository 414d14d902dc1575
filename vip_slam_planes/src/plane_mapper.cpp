// SPDX-License-Identifier: BSD-3-Clause
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
    if (!keyframes_.tied(track.epoch, epoch) || !track.seenSince(keyframes_.sureSince())) continue;
    if (mayBeInView(track, T_map_C, noise.max_range + options.growth.gap)) tracks.push_back(&track);
  }
  return tracks;
}

void PlaneMapper::Impl::grow(const TrackedFrame& frame, const SE3& T_map_odom) {
  const bool usable = frame.status.state == TrackingState::kTracking && !frame.depth_grid.empty() &&
                      keyframes_.newest() != 0 && frame.epoch == keyframes_.newestEpoch() && !localising_ &&
                      !tracks_.empty() && isSound(frame.depth_grid) && isSound(frame.camera_correction);
  const SE3 T_map_C = T_map_odom * frame.state.T_W_I * frame.T_I_C;
  if (!usable || !T_map_C.isFinite() || !pace_.due(T_map_C, options.growth)) {
    ++counters.frames_skipped;
    return;
  }
  const ScopedTimer timer(timing, "planes.grow", frame.t);
  ++counters.frames_grown;
  pace_.grew(T_map_C);
  const std::vector<PlaneTrack*> tracks = tracksInView(T_map_C, frame.epoch);
  if (tracks.empty()) return;
  const DepthMesh& mesh =
      mesher_.build(frame.features, frame.depth_grid, T_map_C.R().row(2), frame.camera_correction.bearing);
  const std::vector<MapTriangle> triangles = placeMesh(mesh, T_map_C);
  std::vector<int> label = associateTriangles(triangles, {tracks.begin(), tracks.end()}, options.growth);
  releaseOtherLayers(triangles, {tracks.begin(), tracks.end()}, &label);
  const CameraPoses& poses = keyframes_.poses();
  const KeyframeId host = poses.count(frame.keyframe) ? frame.keyframe : keyframes_.newest();
  std::vector<double> area(tracks.size(), 0);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (label[i] < 0) continue;
    tracks[label[i]]->cover(triangles[i], host, poses.at(host), nullptr);
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
  keyframes_ = PlacedKeyframes();
  tracks_.clear();
  next_plane_ = 1;
  points_.clear();
  evidence_.clear();
  strips_.clear();
  open_gaps_.clear();
  pace_.clear();
  changes_ = PlaneChanges();
  published.clear();
  came_together_ = localising_ = false;
}

void PlaneMapper::Impl::restore(const std::vector<StoredPlane>& planes, KeyframeId newest_keyframe) {
  clear();
  keyframes_ = PlacedKeyframes(newest_keyframe);
  for (const auto& [estimate, host] : planes) {
    next_plane_ = std::max(next_plane_, estimate.id + 1);
    const bool sound = !estimate.polygons.empty() && !estimate.polygons.front().outer.empty() &&
                       std::all_of(estimate.polygons.begin(), estimate.polygons.end(), isFinite) &&
                       isSound(estimate.plane) && estimate.kind <= PlaneKind::kGeneral && host.T_map_C.isFinite() &&
                       !tracks_.count(estimate.id);
    if (!sound) {
      if (!tracks_.count(estimate.id)) changes_.unpublished(estimate.id);
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
    keyframes_.addHost(host);
    track.confirmed = track.determined = true;
    track.keyframes_seen = static_cast<int>(estimate.keyframes);
    tracks_.emplace(estimate.id, std::move(track));
    published.push_back(estimate);
  }
}

void PlaneMapper::Impl::addKeyframe(const KeyframePtr& keyframe) {
  // A keyframe that was in transit when the map was loaded has the id of a stored one, which it would replace.
  if (!keyframe || keyframes_.known(keyframe->id)) return;
  if (!isSound(keyframe->frame.depth_grid) || !isSound(keyframe->frame.camera_correction)) return;
  counters.keyframes_forgotten += keyframes_.wait(keyframe);
  counters.keyframes_waiting = keyframes_.waiting();
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
