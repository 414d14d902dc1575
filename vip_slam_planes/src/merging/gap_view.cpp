// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/merging/gap_view.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

#include "vip_slam_core/depth/sight.h"
#include "vip_slam_core/util/significance.h"
#include "vip_slam_planes/growth/see_through.h"

namespace vip_slam {
namespace {

constexpr std::size_t kWays = 8, kPlaces = 12;  // lines from the smaller piece to the larger, and points on each
constexpr double kRim = 0.15;                   // m, uncertainty of a piece's border, not tested
constexpr double kOpen = 0.05;                  // share of points that may be open, since poses and depth have errors
constexpr double kFlattest = 0.1;               // cosine of 84 degrees, the mesh's limit for horizontal surfaces

std::vector<Eigen::Vector3d> borderOf(const PlaneTrack& track) {
  std::vector<Eigen::Vector3d> border;
  track.cells().forEach([&](CellIndex c, int) {
    if (track.cells().isBorder(c)) border.push_back(track.cellCentre(c));
  });
  return border;
}

struct Way {
  double square;  // of its length
  Eigen::Vector3d from, to;
};

std::vector<Eigen::Vector3d> placesBetween(const PlaneTrack& small, const PlaneTrack& large) {
  const std::vector<Eigen::Vector3d> ends = borderOf(large);
  std::vector<Way> ways;
  for (const Eigen::Vector3d& from : borderOf(small)) {
    Way way{std::numeric_limits<double>::infinity(), from, from};
    for (const Eigen::Vector3d& to : ends) {
      const double square = (to - from).squaredNorm();
      if (square < way.square) way = {square, from, to};
    }
    ways.push_back(way);
  }
  const std::size_t count = std::min(kWays, ways.size());
  std::partial_sort(ways.begin(), ways.begin() + count, ways.end(),
                    [](const Way& a, const Way& b) { return a.square < b.square; });
  std::vector<Eigen::Vector3d> places;
  for (std::size_t k = 0; k < count; ++k) {
    const double length = std::sqrt(ways[k].square), inner = length - 2 * kRim;
    for (std::size_t i = 0; inner > 0 && i < kPlaces; ++i) {
      const double s = (kRim + inner * (i + 0.5) / kPlaces) / length;
      places.push_back(ways[k].from + s * (ways[k].to - ways[k].from));
    }
  }
  return places;
}

enum class Gap { kOutside, kUnsure, kBlocked, kOpen };

// A place is open when none of the nodes around it shows a surface on the plane or in front of it. Missing depth counts
// as open, since not every floor next to a table has depth.
Gap look(const DepthGrid& grid, const Eigen::Vector3d& p, const Eigen::Vector3d& n_C, const SceneView& view) {
  const SightLine line = sightLine(grid, view.camera, p);
  if (!line.inside) return Gap::kOutside;
  const double facing = -n_C.dot(p) / p.z();  // |n . ray|
  if (!view.views.noise.inRange(p.z()) || -n_C.dot(p) < kFlattest * p.norm()) return Gap::kUnsure;
  const Sight sight =
      line.at(p.z(), (view.see_through + kNoiseSigmas * view.views.noise.sigma(p.z()) * facing) / facing);
  if (sight != Sight::kThrough && sight != Sight::kNothing) return Gap::kBlocked;
  // At a flat angle missing depth may be that of the surface itself.
  return line.measured < 4 && -n_C.dot(p) < kGrazing * p.norm() ? Gap::kUnsure : Gap::kOpen;
}

}  // namespace

void OpenGaps::rename(PlaneId from, PlaneId into) {
  std::vector<PlaneId> beside;
  for (const auto& pair : pairs_) {
    if (pair.first == from || pair.second == from) beside.push_back(pair.first == from ? pair.second : pair.first);
  }
  remove(from);
  for (const PlaneId id : beside) {
    if (id != into) add(id, into);
  }
}

void OpenGaps::remove(PlaneId id) {
  for (auto it = pairs_.begin(); it != pairs_.end();) {
    it = it->first == id || it->second == id ? pairs_.erase(it) : std::next(it);
  }
}

bool gapMayBeOpen(const PlaneTrack& small, const PlaneTrack& large, const SceneView& view) {
  if (view.open_gaps.has(small.id(), large.id())) return true;
  std::vector<const Keyframe*> witnesses;
  bool witnessed[2] = {false, false};
  for (const auto& [id, keyframe] : view.views.keyframes) {
    const bool shows[2] = {small.restsOn(id), large.restsOn(id)};
    if (!(shows[0] || shows[1]) || !view.views.poses.count(id) || keyframe->frame.depth_grid.empty()) continue;
    witnesses.push_back(keyframe.get());
    for (int k = 0; k < 2; ++k) witnessed[k] = witnessed[k] || shows[k];
  }
  if (!witnessed[0] || !witnessed[1]) return true;
  const std::vector<Eigen::Vector3d> places = placesBetween(small, large);
  const double few = kOpen * static_cast<double>(places.size());
  std::vector<Gap> seen(places.size(), Gap::kOutside);
  std::size_t open = 0;
  for (const Keyframe* keyframe : witnesses) {
    const SE3 T_C_map = view.views.poses.at(keyframe->id).inverse();
    const Eigen::Vector3d n_C = T_C_map.rotation() * large.plane().n;
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (seen[k] == Gap::kOpen) continue;
      seen[k] = std::max(seen[k], look(keyframe->frame.depth_grid, T_C_map * places[k], n_C, view));
      if (seen[k] == Gap::kOpen && ++open > few) {
        view.open_gaps.add(small.id(), large.id());
        return true;
      }
    }
  }
  const auto unsure = static_cast<std::size_t>(std::count(seen.begin(), seen.end(), Gap::kUnsure));
  return 2 * unsure > places.size();
}

}  // namespace vip_slam
