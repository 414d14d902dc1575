// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/place_surfaces.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace vip_slam {
namespace {

constexpr int kEvery = 3;                          // nodes of the grid, in both directions
constexpr std::size_t kFewest = 8;                 // points of a plane that is used
constexpr double kOnPlane = 0.03, kNear = 0.10;    // metres, distance from the plane of the view's point, of the grid's
constexpr double kSigma = 0.01, kIndependent = 6;  // metres; effective number of independent points of a plane

}  // namespace

std::vector<PlaceSurface> matchSurfaces(const Map& map, KeyframeId view, const DepthGrid& grid, const SE3& T_W_C,
                                        const CameraModel& model, std::uint32_t camera) {
  const MapKeyframe& kf = map.keyframe(view);
  const DepthGrid& theirs = kf.data->frame.depth_grid;
  std::vector<PlaceSurface> surfaces;
  if (grid.empty() || theirs.empty() || kf.planes.empty()) return surfaces;
  const SE3 T_W_V = kf.T_W_C(), T_V_C = T_W_V.inverse() * T_W_C;
  std::map<PlaneId, std::vector<PlaceSurface>> found;
  for (int r = 0; r < grid.rows; r += kEvery)
    for (int c = 0; c < grid.cols; c += kEvery) {
      const double z = grid.at(c, r);
      if (z <= 0) continue;
      const Eigen::Vector3d p_C = model.unproject(grid.pixel(c, r), z), p_V = T_V_C * p_C;
      Eigen::Vector2d uv;
      if (p_V.z() < 0.2 || !model.project(p_V, &uv) || !model.inImage(uv)) continue;
      const int tc = static_cast<int>(std::lround((uv.x() - theirs.offset) / theirs.stride));
      const int tr = static_cast<int>(std::lround((uv.y() - theirs.offset) / theirs.stride));
      if (tc < 0 || tr < 0 || tc >= theirs.cols || tr >= theirs.rows || theirs.at(tc, tr) <= 0) continue;
      const Eigen::Vector3d q_W = T_W_V * model.unproject(theirs.pixel(tc, tr), theirs.at(tc, tr));
      const Eigen::Vector3d p_W = T_W_C * p_C;
      // At an edge between two planes the point cannot be assigned.
      const MapPlane *shown = nullptr, *nearest = nullptr;
      int on = 0;
      for (const auto& seen : kf.planes) {
        const auto it = map.planes().find(seen.first);
        if (it == map.planes().end()) continue;
        const Plane& plane = it->second.estimate.plane;
        if (!nearest || std::abs(plane.signedDistance(p_W)) < std::abs(nearest->estimate.plane.signedDistance(p_W)))
          nearest = &it->second;
        if (std::abs(plane.signedDistance(q_W)) > kOnPlane) continue;
        shown = &it->second;
        ++on;
      }
      if (on != 1 || shown != nearest || std::abs(shown->estimate.plane.signedDistance(p_W)) > kNear) continue;
      found[shown->estimate.id].push_back({camera, p_C, shown->estimate.plane, kSigma});
    }
  for (auto& plane : found) {
    if (plane.second.size() < kFewest) continue;
    const double sigma = kSigma * std::sqrt(std::max(1.0, static_cast<double>(plane.second.size()) / kIndependent));
    for (PlaceSurface& surface : plane.second) {
      surface.sigma = sigma;
      surfaces.push_back(surface);
    }
  }
  return surfaces;
}

}  // namespace vip_slam
