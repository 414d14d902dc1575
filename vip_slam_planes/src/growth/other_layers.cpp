// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/growth/other_layers.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/significance.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_planes/detection/surface_layers.h"

namespace vip_slam {

std::vector<PlaneId> releaseOtherLayers(const std::vector<MapTriangle>& triangles,
                                        const std::vector<const PlaneTrack*>& tracks, double min_step,
                                        std::vector<int>* label) {
  std::vector<PlaneId> beside(label->size(), 0);
  std::vector<std::vector<int>> members(tracks.size());
  for (std::size_t i = 0; i < label->size(); ++i) {
    if ((*label)[i] >= 0) members[(*label)[i]].push_back(static_cast<int>(i));
  }
  std::vector<double> offset, area, sigma;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (members[k].empty()) continue;
    offset.clear(), area.clear(), sigma.clear();
    for (int i : members[k]) {
      offset.push_back(tracks[k]->plane().signedDistance(triangles[i].centre));
      area.push_back(triangles[i].area);
      sigma.push_back(triangles[i].sigma);
    }
    const double noise = upperMedian(sigma), step = std::max(min_step, kNoiseSigmas * noise);
    const auto [low, high] = std::minmax_element(offset.begin(), offset.end());
    if (*high - *low < step) continue;
    const auto layers = splitLayers(offset, area, noise);
    if (layers.size() < 2) continue;
    std::vector<double> depth;
    for (const std::vector<int>& layer : layers) {
      std::vector<double> own;
      for (int i : layer) own.push_back(offset[i]);
      depth.push_back(upperMedian(std::move(own)));
    }
    const double nearest =
        *std::min_element(depth.begin(), depth.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
    for (std::size_t j = 0; j < layers.size(); ++j) {
      if (std::abs(depth[j] - nearest) < step) continue;
      for (int i : layers[j]) {
        (*label)[members[k][i]] = -1;
        beside[members[k][i]] = tracks[k]->id();
      }
    }
  }
  return beside;
}

}  // namespace vip_slam
