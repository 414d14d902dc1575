// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/growth/plane_track.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "vip_slam_core/geometry/plane_noise.h"

namespace vip_slam {
namespace {

constexpr double kMinTurn = 1e-3, kMinShift = 1e-3;  // radians, metres; smaller changes are ignored
constexpr double kLargeTurn = 0.3;  // radians; an adjustment turns hosts by less, a loop that joins parts by any angle

}  // namespace

PlaneTrack::PlaneTrack(PlaneId id, PlaneKind kind, const Plane& plane, const Eigen::Vector3d& origin, double cell)
    : id_(id), kind_(kind), plane_(plane), cell_(cell) {
  // Walls: x horizontal, y up. Floors: x along the map's x. So that cells and polygons of walls are upright rectangles.
  const Eigen::Vector3d level = Eigen::Vector3d::UnitZ().cross(plane.n);
  alignFrame(level.norm() > 0.1 ? level : Eigen::Vector3d::UnitX(), origin);
}

void PlaneTrack::alignFrame(const Eigen::Vector3d& ex_hint, const Eigen::Vector3d& origin_hint) {
  origin_ = plane_.project(origin_hint);
  ex_ = (ex_hint - plane_.n * plane_.n.dot(ex_hint)).normalized();
  ey_ = plane_.n.cross(ex_);
}

void PlaneTrack::setPlane(const Plane& plane) {
  plane_ = plane.n.dot(plane_.n) < 0 ? plane.flipped() : plane;
  alignFrame(ex_, origin_);
}

void PlaneTrack::coverCell(CellIndex c, int hits, KeyframeId host, const SE3& T_map_C) {
  const int before = cells_.at(c);
  cells_.set(c, std::min(kMaxHits, before + hits));
  if (before > 0 || cells_.at(c) == 0) return;  // covered before, or outside the largest grid
  area_changed_ = grown_ = true;
  lost_ = std::max(0, lost_ - 1);
  auto [it, fresh] = patches_.try_emplace(host);
  if (fresh) it->second.T_map_C = T_map_C;
  it->second.cells_C.push_back((it->second.T_map_C.inverse() * cellCentre(c)).cast<float>());
  if (++covered_since_ > cells_.count(1)) dropStaleCells();
}

// A cell that is cleared and covered again has an entry with each of its hosts.
void PlaneTrack::dropStaleCells() {
  covered_since_ = 0;
  CellGrid taken;
  for (auto& [host, patch] : patches_) {
    const auto stale = [&, &patch = patch](const Eigen::Vector3f& p_C) {
      const CellIndex c = cellAt(toPlane(patch.T_map_C * p_C.cast<double>()));
      if (cells_.at(c) == 0 || taken.at(c) > 0) return true;
      taken.set(c, 1);
      return false;
    };
    patch.cells_C.erase(std::remove_if(patch.cells_C.begin(), patch.cells_C.end(), stale), patch.cells_C.end());
  }
}

void PlaneTrack::cover(const MapTriangle& triangle, KeyframeId host, const SE3& T_map_C,
                       std::vector<CellIndex>* touched) {
  forCellsOfTriangle(toPlane(triangle.corner[0]), toPlane(triangle.corner[1]), toPlane(triangle.corner[2]), cell_,
                     [&](CellIndex c) {
                       if (cells_.at(c) == 0) {
                         coverCell(c, 1, host, T_map_C);
                       } else if (touched) {
                         touched->push_back(c);
                       }
                     });
}

void PlaneTrack::coverPolygon(const Ring2d& outer, const std::vector<Ring2d>& holes, int hits, const PlaneHost& host) {
  if (outer.size() < 3) return;
  Eigen::Vector2d low = outer.front(), high = low;
  for (const Eigen::Vector2d& q : outer) low = low.cwiseMin(q), high = high.cwiseMax(q);
  std::vector<const Ring2d*> rings = {&outer};
  for (const Ring2d& hole : holes) rings.push_back(&hole);
  std::vector<double> edges;  // crossings of outline and holes with a row: inside between each pair of them
  for (int y = cellAt(low).y; y <= cellAt(high).y; ++y) {
    const double v = (y + 0.5) * cell_;
    edges.clear();
    for (const Ring2d* ring : rings) {
      for (std::size_t i = 0, j = ring->size() - 1; i < ring->size(); j = i++) {
        const Eigen::Vector2d &a = (*ring)[i], &b = (*ring)[j];
        if ((a.y() > v) == (b.y() > v)) continue;
        edges.push_back((b.x() - a.x()) * (v - a.y()) / (b.y() - a.y()) + a.x());
      }
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t k = 0; k + 1 < edges.size(); k += 2) {
      const int last = cellAt({edges[k + 1], v}).x;
      for (int x = cellAt({edges[k], v}).x; x <= last; ++x) {
        const double u = (x + 0.5) * cell_;
        if (u >= edges[k] && u < edges[k + 1]) coverCell({x, y}, hits, host.keyframe, host.T_map_C);
      }
    }
  }
}

Plane PlaneTrack::carriedAlong(const SE3& move, const SE3& T_map_C, const std::vector<Eigen::Vector3f>& cells_C) const {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(), n = plane_.n;
  for (const Eigen::Vector3f& p_C : cells_C) middle += p_C.cast<double>() / double(cells_C.size());
  if (kind_ != PlaneKind::kHorizontal) n = move.rotation() * n;
  if (kind_ == PlaneKind::kVertical) n.z() = 0;
  return Plane::fromPointNormal(move * plane_.project(T_map_C * middle), n.normalized());
}

std::pair<const PlaneTrack::Patch*, SE3> PlaneTrack::mainMove(const CameraPoses& poses) const {
  std::pair<const Patch*, SE3> main = {nullptr, SE3()};
  for (const auto& [host, patch] : patches_) {
    const auto it = poses.find(host);
    if (it == poses.end() || (main.first && patch.cells_C.size() <= main.first->cells_C.size())) continue;
    main = {&patch, it->second * patch.T_map_C.inverse()};
  }
  return main;
}

void PlaneTrack::turnWithKeyframes(const CameraPoses& poses) {
  const auto [main, move] = mainMove(poses);
  if (!main || main->cells_C.empty() || logSO3(move.rotation()).norm() < kLargeTurn) return;
  plane_ = carriedAlong(move, main->T_map_C, main->cells_C);
  alignFrame(move.rotation() * ex_, move * origin_);
  for (auto& [host, patch] : patches_) patch.T_map_C = move * patch.T_map_C;
  area_changed_ = grown_ = true;
}

void PlaneTrack::followKeyframes(const CameraPoses& poses) {
  const auto [main, main_move] = mainMove(poses);
  bool moved = false;
  for (const auto& [host, patch] : patches_) {
    const auto it = poses.find(host);
    if (it == poses.end()) continue;
    const SE3 move = it->second * patch.T_map_C.inverse();
    if (!patch.cells_C.empty()) {
      const Eigen::Vector3d p = patch.T_map_C * patch.cells_C.front().cast<double>();
      const Eigen::Vector3d shift = move * p - p;
      moved = moved || (shift - plane_.n * plane_.n.dot(shift)).norm() > 0.5 * cell_;
    }
  }
  Plane carried = plane_;
  if (main && !main->cells_C.empty() && followsHosts()) {
    carried = carriedAlong(main_move, main->T_map_C, main->cells_C);
    const Eigen::Vector3d p = main_move * (main->T_map_C * main->cells_C.front().cast<double>());
    moved = moved || std::abs(carried.signedDistance(p) - plane_.signedDistance(p)) > kMinShift ||
            (carried.n - plane_.n).norm() > kMinTurn;
  }
  if (!moved) return;
  area_changed_ = grown_ = true;

  // Position of each cell before the frame moves.
  CellGrid old;
  std::swap(old, cells_);
  struct Source {
    Patch* patch;
    std::vector<int> hits;
  };
  std::vector<Source> sources;
  for (auto& [host, patch] : patches_) {
    Source source{&patch, {}};
    std::vector<Eigen::Vector3f> kept;
    for (const Eigen::Vector3f& p_C : patch.cells_C) {
      const int h = old.at(cellAt(toPlane(patch.T_map_C * p_C.cast<double>())));
      if (h == 0) continue;  // cleared since
      kept.push_back(p_C);
      source.hits.push_back(h);
    }
    patch.cells_C = std::move(kept);
    const auto it = poses.find(host);
    if (it != poses.end()) patch.T_map_C = it->second;
    sources.push_back(std::move(source));
  }
  plane_ = carried;
  alignFrame(main_move.rotation() * ex_, main_move * origin_);
  for (const Source& source : sources) {
    for (std::size_t i = 0; i < source.hits.size(); ++i) {
      const CellIndex c = cellAt(toPlane(source.patch->T_map_C * source.patch->cells_C[i].cast<double>()));
      cells_.set(c, std::max(cells_.at(c), source.hits[i]));
    }
  }
  // The frame moved with the host of most cells, so in it most cells are about where they were.
  cells_.closePinholes([&old](CellIndex c) { return old.at(c) > 0; });
}

void PlaneTrack::rehost(KeyframeId from, KeyframeId to, const CameraPoses& poses) {
  observations_.erase(from);
  const auto it = patches_.find(from);
  if (it == patches_.end()) return;
  const auto target = poses.find(to);
  Patch moved = std::move(it->second);
  patches_.erase(it);
  auto [patch, fresh] = patches_.try_emplace(to);
  if (fresh) patch->second.T_map_C = target == poses.end() ? SE3() : target->second;
  const SE3 T_to_from = patch->second.T_map_C.inverse() * moved.T_map_C;
  for (const Eigen::Vector3f& p : moved.cells_C) {
    patch->second.cells_C.push_back((T_to_from * p.cast<double>()).cast<float>());
  }
}

void PlaneTrack::absorb(const PlaneTrack& other, const CameraPoses& poses) {
  CellGrid taken;  // a cell may have entries with several hosts
  for (const auto& [host, patch] : other.patches_) {
    const auto pose = poses.find(host);
    const SE3 T_map_C = pose == poses.end() ? patch.T_map_C : pose->second;
    for (const Eigen::Vector3f& p_C : patch.cells_C) {
      const Eigen::Vector3d p = patch.T_map_C * p_C.cast<double>();
      const CellIndex theirs = other.cellAt(other.toPlane(p));
      const int hits = other.cells_.at(theirs);
      if (hits == 0 || taken.at(theirs) > 0) continue;
      taken.set(theirs, 1);
      coverCell(cellAt(toPlane(p)), hits, host, T_map_C);
    }
  }
  cells_.closePinholes([&](CellIndex c) { return other.cells_.at(other.cellAt(other.toPlane(cellCentre(c)))) > 0; });
  for (const auto& [keyframe, theirs] : other.observations_) {
    auto [it, fresh] = observations_.emplace(keyframe, theirs);
    PlaneObservation& mine = it->second;
    mine.plane = id_;
    if (fresh) continue;
    addPiece(theirs, &mine);
  }
  keyframes_seen = std::max<int>(keyframes_seen, static_cast<int>(observations_.size()));
  stored = stored || other.stored;
  confirmed = confirmed || other.confirmed;
  determined = determined || other.determined;
}

PlaneMoments samplesOf(const PlaneObservation& observation) { return {observation.G / observation.weight_scale}; }

PlaneMoments informationOf(const PlaneObservation& observation, const Eigen::Vector3d& n_C, const PlaneViews& views,
                           double together) {
  const Eigen::Matrix4d samples = samplesOf(observation).M;
  const SurfaceNoise noise = surfaceNoise(samples, observation.points.size(), n_C, views.noise, views.parts);
  const Eigen::Matrix4d G = samples / noise.white, T = sharedErrorShrinkage(G, together * noise.shared);
  return {T * G * T.transpose()};
}

double PlaneTrack::together(Observations::const_iterator view, const PlaneViews& views) const {
  const auto keyframe = views.keyframes.find(view->first);
  if (keyframe == views.keyframes.end()) return 1;
  const TrackedFrame& mine = keyframe->second->frame;
  // False where the error is another one, as for all views beyond.
  const auto add = [&](Observations::const_iterator other, double* count) {
    const auto found = views.keyframes.find(other->first);
    if (found == views.keyframes.end() || found->second->frame.epoch != mine.epoch) return false;
    const double correlation = sharedDepth(found->second->frame.t - mine.t);
    *count += correlation;
    return correlation > 0;
  };
  double count = 1;
  for (auto other = std::next(view); other != observations_.end() && add(other, &count); ++other) continue;
  for (auto other = view; other != observations_.begin() && add(std::prev(other), &count); --other) continue;
  return count;
}

PlaneMoments PlaneTrack::samples(const CameraPoses& poses) const {
  PlaneMoments sum;
  for (const auto& [keyframe, observation] : observations_) {
    const auto it = poses.find(keyframe);
    if (it != poses.end()) sum.M += samplesOf(observation).transformed(it->second).M;
  }
  return sum;
}

PlaneMoments PlaneTrack::information(const PlaneViews& views) const {
  PlaneMoments sum;
  for (auto it = observations_.begin(); it != observations_.end(); ++it) {
    const auto pose = views.poses.find(it->first);
    if (pose == views.poses.end()) continue;
    const Eigen::Vector3d n_C = pose->second.R().transpose() * plane_.n;
    sum.M += informationOf(it->second, n_C, views, together(it, views)).transformed(pose->second).M;
  }
  return sum;
}

bool PlaneTrack::changed(bool reset) {
  const bool changed = grown_ || (plane_.n - last_checked_.n).norm() > kMinTurn ||
                       std::abs(last_checked_.signedDistance(origin_)) > kMinShift;
  if (reset) grown_ = false, last_checked_ = plane_;
  return changed;
}

std::vector<PlanePolygon> PlaneTrack::polygons(int min_hits) {
  // Staircases of diagonal borders are one cell high; pieces smaller than three by three cells are specks.
  const double speck = 9 * cell_ * cell_;
  const auto lift = [&](const Ring2d& ring) {
    Ring out;
    for (const Eigen::Vector2d& q : ring) out.push_back(fromPlane(q));
    return out;
  };
  std::vector<PlanePolygon> result;
  // A change of hits alone matters only with min_hits above one.
  if (area_changed_ || (hits_changed_ && min_hits > 1)) {
    outlines_ = traceOutlines(cells_, cell_, min_hits, 0.5 * speck, speck, 0.8 * cell_);
  }
  area_changed_ = hits_changed_ = false;
  for (const Outline& outline : outlines_) {
    PlanePolygon polygon;
    polygon.outer = lift(outline.outer);
    for (const Ring2d& hole : outline.holes) polygon.holes.push_back(lift(hole));
    result.push_back(std::move(polygon));
  }
  return result;
}

}  // namespace vip_slam
