#include "vip_slam_backend/loop/place_coverage.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace vip_slam {
namespace {

constexpr std::size_t kCoveringViews = 5;
constexpr double kDepthSlack = 0.1, kDepthSlackPerMetre = 0.05;

int cellOf(const Feature& feature, const CameraModel& camera) {
  return static_cast<int>(feature.pixel.x() * 8 / camera.width()) * 6 +
         static_cast<int>(feature.pixel.y() * 6 / camera.height());
}

}  // namespace

bool shows(const DepthGrid& grid, const Eigen::Vector3d& p_V, const CameraModel& camera) {
  Eigen::Vector2d uv;
  if (p_V.z() < 0.2 || !camera.project(p_V, &uv) || !camera.inImage(uv, 10)) return false;
  if (grid.empty()) return true;
  const int c = static_cast<int>(std::lround((uv.x() - grid.offset) / grid.stride));
  const int r = static_cast<int>(std::lround((uv.y() - grid.offset) / grid.stride));
  if (c < 0 || r < 0 || c >= grid.cols || r >= grid.rows) return false;
  const double z = grid.at(c, r);
  return z <= 0 || z > p_V.z() - kDepthSlack - kDepthSlackPerMetre * p_V.z();
}

PlaceCoverage placeCoverage(const Map& map, const std::vector<Feature>& features, const std::vector<bool>& inlier,
                            const SE3& T_W_C, const std::vector<KeyframeId>& views, const CameraModel& camera) {
  std::vector<SE3> T_V_C;
  for (std::size_t v = 0; v < std::min(kCoveringViews, views.size()); ++v)
    T_V_C.push_back(map.keyframe(views[v]).T_W_C().inverse() * T_W_C);
  PlaceCoverage coverage;
  std::set<int> covered, explained;
  for (std::size_t f = 0; f < features.size(); ++f) {
    const Feature& feature = features[f];
    if (inlier[f]) explained.insert(cellOf(feature, camera));
    if (feature.depth <= 0) continue;
    const Eigen::Vector3d p_C = feature.depth * Eigen::Vector3d(feature.xy.x(), feature.xy.y(), 1.0);
    bool shown = false;
    for (std::size_t v = 0; v < T_V_C.size() && !shown; ++v)
      shown = shows(map.keyframe(views[v]).data->frame.depth_grid, T_V_C[v] * p_C, camera);
    if (!shown) continue;
    ++coverage.features;
    covered.insert(cellOf(feature, camera));
  }
  coverage.cells = static_cast<int>(covered.size());
  for (const int cell : covered) coverage.explained_cells += static_cast<int>(explained.count(cell));
  return coverage;
}

}  // namespace vip_slam
