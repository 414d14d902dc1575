// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/place_coverage.h"

#include <algorithm>
#include <set>

#include "vip_slam_backend/loop/scene_agreement.h"
#include "vip_slam_core/depth/sight.h"

namespace vip_slam {
namespace {

constexpr std::size_t kCoveringViews = 5;

int cellOf(const Feature& feature, const CameraModel& camera) {
  return static_cast<int>(feature.pixel.x() * 8 / camera.width()) * 6 +
         static_cast<int>(feature.pixel.y() * 6 / camera.height());
}

}  // namespace

bool shows(const DepthGrid& grid, const Eigen::Vector3d& p_V, const CameraModel& camera) {
  if (grid.empty()) {
    Eigen::Vector2d uv;
    return p_V.z() > 0 && camera.project(p_V, &uv) && camera.inImage(uv);
  }
  const Sight sight = sightLine(grid, camera, p_V).at(p_V.z(), depthSlack(p_V.z()));
  return sight != Sight::kOutside && sight != Sight::kHidden;
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
