// SPDX-License-Identifier: BSD-3-Clause
// One plane of the mapper: parameters, covered cells, and the contributions of each keyframe.
//
// Cells are stored as points in the camera frame of the keyframe that first covered them, so that a correction of the
// keyframes (loop closure) moves the area with them; the grid is a rasterisation of them in the plane's own 2D frame.
#pragma once

#include <algorithm>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/plane_map.h"
#include "vip_slam_planes/detection/plane_fit.h"
#include "vip_slam_planes/growth/cell_grid.h"
#include "vip_slam_planes/growth/outline.h"
#include "vip_slam_planes/mesh/map_triangles.h"

namespace vip_slam {

/// Camera poses T_map_C of placed keyframes.
using CameraPoses = std::unordered_map<KeyframeId, SE3>;

/// The keyframes that see planes, and how far their depth is to be trusted.
struct PlaneViews {
  const std::map<KeyframeId, KeyframePtr>& keyframes;  ///< hosts of a loaded map's planes are missing
  const CameraPoses& poses;                            ///< keyframes without a pose are not used
  const DepthNoise& noise;
  DepthNoiseParts parts;  ///< of the recording, as far as they are known now
};

/// Moments of a view's samples, in its camera.
PlaneMoments samplesOf(const PlaneObservation& observation);
/// What they say of a plane with the normal `n_C` there, with the error that they share (plane_noise.h). `together`:
/// the number of views that share it.
PlaneMoments informationOf(const PlaneObservation& observation, const Eigen::Vector3d& n_C, const PlaneViews& views,
                           double together = 1);

class PlaneTrack {
 public:
  PlaneTrack(PlaneId id, PlaneKind kind, const Plane& plane, const Eigen::Vector3d& origin, double cell);

  PlaneId id() const { return id_; }
  PlaneKind kind() const { return kind_; }
  const Plane& plane() const { return plane_; }
  double cellSize() const { return cell_; }
  const CellGrid& cells() const { return cells_; }
  double area() const { return cells_.count(1) * cell_ * cell_; }

  Eigen::Vector2d toPlane(const Eigen::Vector3d& p) const { return {ex_.dot(p - origin_), ey_.dot(p - origin_)}; }
  Eigen::Vector3d fromPlane(const Eigen::Vector2d& q) const { return origin_ + q.x() * ex_ + q.y() * ey_; }
  CellIndex cellAt(const Eigen::Vector2d& q) const {
    return {static_cast<int>(std::floor(q.x() / cell_)), static_cast<int>(std::floor(q.y() / cell_))};
  }
  Eigen::Vector3d cellCentre(CellIndex c) const { return fromPlane({(c.x + 0.5) * cell_, (c.y + 0.5) * cell_}); }

  /// Sets new parameters; the normal keeps its present side, and the area moves with the plane.
  void setPlane(const Plane& plane);
  /// Whether the back end optimises the parameters; then they are not refitted here.
  void setOptimised(bool optimised) { optimised_ = optimised; }
  bool optimised() const { return optimised_; }

  /// Covers the cells under a triangle, seen from keyframe `host` with camera pose T_map_C, and adds them to `touched`.
  void cover(const MapTriangle& triangle, KeyframeId host, const SE3& T_map_C, std::vector<CellIndex>* touched);
  void hit(CellIndex c) {
    cells_.set(c, std::min(kMaxHits, cells_.at(c) + 1));
    hits_changed_ = true;
  }
  void coverCell(CellIndex c, int hits, KeyframeId host, const SE3& T_map_C);
  /// Covers a polygon of a loaded map. Without a host it only moves with the plane.
  void coverPolygon(const Ring2d& outer, const std::vector<Ring2d>& holes, int hits, const PlaneHost& host = {});
  void miss(CellIndex c) {
    cells_.set(c, cells_.at(c) - 1);
    area_changed_ = true;
    lost_ += cells_.at(c) == 0;
  }

  /// After a correction that rotates the hosts by a large angle, as when a loop ties parts of the map, rotates the
  /// plane with the host with most cells, so that its normal stays on the side that it was seen from.
  void turnWithKeyframes(const CameraPoses& poses);
  /// Rasterises the cells again when hosts have moved by more than half a cell since the last time; the 2D frame
  /// follows the host with most cells, so that a rigid correction needs no resampling. So does the plane itself while
  /// nothing else determines it.
  void followKeyframes(const CameraPoses& poses);
  /// Hands the cells of a removed keyframe over to another one.
  void rehost(KeyframeId from, KeyframeId to, const CameraPoses& poses);
  /// Takes over the cells and observations of a plane that was merged into this one.
  void absorb(const PlaneTrack& other, const CameraPoses& poses);

  std::map<KeyframeId, PlaneObservation>& observations() { return observations_; }
  const std::map<KeyframeId, PlaneObservation>& observations() const { return observations_; }
  /// Whether some of its area or an observation belongs to a keyframe.
  bool restsOn(KeyframeId keyframe) const { return observations_.count(keyframe) > 0 || patches_.count(keyframe) > 0; }
  /// Whether some keyframe from this one on has seen it.
  bool seenSince(KeyframeId keyframe) const {
    const auto newest = [](const auto& by_keyframe) { return by_keyframe.empty() ? 0 : by_keyframe.rbegin()->first; };
    return std::max(newest(observations_), newest(patches_)) >= keyframe;
  }
  /// Whether it has neither observations nor a loaded map's data, and all its hosts exist: it moves with its main host.
  bool followsHosts() const { return observations_.empty() && !stored && !patches_.count(0); }
  /// Moments in `map` of all samples of its observations: what a plane is fitted to.
  PlaneMoments samples(const CameraPoses& poses) const;
  /// Moments in `map` that say how well the plane is known: with what a view's samples share, and views within a
  /// second.
  PlaneMoments information(const PlaneViews& views) const;

  /// Outlines are traced again only when the area changed; the points always lie on the present plane.
  std::vector<PlanePolygon> polygons(int min_hits);
  /// Whether area or parameters changed noticeably since the last call with `reset`.
  bool changed(bool reset);

  /// Whether keyframes have seen through most of the covered area: the surface was removed, and the remaining cells are
  /// rims that no view can refute (the foot of a partition has the floor close behind it).
  bool mostlyGone() const { return lost_ > cells_.count(1); }

  /// Whether it is published to other modules.
  bool known() const { return confirmed && (agrees || kind_ != PlaneKind::kVertical); }

  // Book-keeping of the mapper.
  std::uint32_t epoch = 0;  ///< of the keyframe that started it
  bool stored = false;      ///< all or part of it comes from a loaded map
  bool confirmed = false;
  bool determined = false;    ///< its observations determine its direction; until then they are not published
  bool agrees = true;         ///< its observations agree; otherwise it may be several surfaces and takes no points
  bool takes_points = false;  ///< known, determined and agreeing at the last update
  bool refit_due = false;     ///< observations were removed since the last fit
  int keyframes_seen = 0;     ///< number of keyframes that ever saw a fair part of it
  int views_seen = 0;         ///< number of growth frames that did before it was confirmed, each from another place
  Eigen::Vector3d viewed_from = Eigen::Vector3d::Zero();  ///< camera centre of the last keyframe or view that did
  int contradictions = 0;    ///< consecutive keyframes that showed another surface at its place
  int keyframes_waited = 0;  ///< number of keyframes with it in view before it was confirmed

 private:
  using Observations = std::map<KeyframeId, PlaneObservation>;
  /// How many views share the error of this one, itself included.
  double together(Observations::const_iterator view, const PlaneViews& views) const;

  struct Patch {
    SE3 T_map_C;                           ///< of the host, when last rasterised
    std::vector<Eigen::Vector3f> cells_C;  ///< cell centres in the host's camera frame
  };
  /// Keeps one entry of each covered cell, with its first host.
  void dropStaleCells();
  /// The host with most cells and how it has moved since they were last rasterised; null without any.
  std::pair<const Patch*, SE3> mainMove(const CameraPoses& poses) const;
  /// The plane moved with the keyframe that shows these cells; a horizontal or vertical plane stays so.
  Plane carriedAlong(const SE3& move, const SE3& T_map_C, const std::vector<Eigen::Vector3f>& cells_C) const;
  void alignFrame(const Eigen::Vector3d& ex_hint, const Eigen::Vector3d& origin_hint);

  PlaneId id_;
  PlaneKind kind_;
  Plane plane_;
  bool optimised_ = false;
  double cell_;
  Eigen::Vector3d origin_, ex_, ey_;
  CellGrid cells_;
  bool area_changed_ = true, grown_ = true, hits_changed_ = false;
  int lost_ = 0;
  int covered_since_ = 0;  ///< cells covered since stale entries were dropped
  std::vector<Outline> outlines_;
  Plane last_checked_;
  std::map<KeyframeId, Patch> patches_;  ///< by host; host 0: cells whose keyframe was removed, in `map`
  Observations observations_;
};

}  // namespace vip_slam
