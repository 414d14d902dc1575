#include "vip_slam_planes/merging/gap_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace vip_slam {
namespace {

constexpr std::size_t kWays = 8, kPlaces = 12;  // from as many border cells of the smaller piece, on each
constexpr double kRim = 0.15;                   // m; the rim of a piece is not known better
constexpr double kOpen = 0.05;                  // share of the places; poses and depth are not exact
constexpr double kGrazing = 0.25;               // cosine of 75 degrees

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

/// Whether the four nodes around a place's image show nothing in front of it or on the plane: depth behind it, or none.
/// Not every floor beside a table gives depth.
bool seesThrough(const DepthGrid& grid, const Eigen::Vector3d& p, const Eigen::Vector3d& n_C, const SceneView& view) {
  Eigen::Vector2d uv;
  if (!view.noise.inRange(p.z()) || -n_C.dot(p) < kGrazing * p.norm()) return false;
  if (!view.camera.project(p, &uv) || !view.camera.inImage(uv)) return false;
  int c = 0, r = 0;
  if (!grid.nodesAround(uv, &c, &r)) return false;
  const double facing = -n_C.dot(p) / p.z();  // |n . ray|
  const double slack = (view.see_through + 3 * view.noise.sigma(p.z()) * facing) / facing;
  for (int k = 0; k < 4; ++k) {
    const double z = grid.at(c + (k & 1), r + (k >> 1));
    if (z > 0 && z <= p.z() + slack) return false;
  }
  return true;
}

}  // namespace

bool gapIsOpen(const PlaneTrack& small, const PlaneTrack& large, const SceneView& view) {
  std::vector<const Keyframe*> witnesses;
  bool witnessed[2] = {false, false};
  for (const auto& [id, keyframe] : view.keyframes) {
    const bool shows[2] = {small.restsOn(id), large.restsOn(id)};
    if (!(shows[0] || shows[1]) || !view.poses.count(id) || keyframe->frame.depth_grid.empty()) continue;
    witnesses.push_back(keyframe.get());
    for (int k = 0; k < 2; ++k) witnessed[k] = witnessed[k] || shows[k];
  }
  if (!witnessed[0] || !witnessed[1]) return true;
  const std::vector<Eigen::Vector3d> places = placesBetween(small, large);
  std::vector<char> open(places.size(), 0);
  std::size_t count = 0;
  for (const Keyframe* keyframe : witnesses) {
    const SE3 T_C_map = view.poses.at(keyframe->id).inverse();
    const Eigen::Vector3d n_C = T_C_map.rotation() * large.plane().n;
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (open[k] || !seesThrough(keyframe->frame.depth_grid, T_C_map * places[k], n_C, view)) continue;
      open[k] = 1;
      if (++count > kOpen * static_cast<double>(places.size())) return true;
    }
  }
  return false;
}

}  // namespace vip_slam
