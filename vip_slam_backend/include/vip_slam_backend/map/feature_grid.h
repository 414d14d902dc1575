// SPDX-License-Identifier: BSD-3-Clause
// Finds features near a pixel: those of a keyframe by cells of the image.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/types/feature.h"

namespace vip_slam {

class FeatureGrid {
 public:
  /// For features within `radius` px. `features` outlive this.
  FeatureGrid(const std::vector<Feature>& features, int width, int height, double radius)
      : radius_(radius),
        cols_(static_cast<int>(width / (2 * radius)) + 1),
        cells_(static_cast<std::size_t>(cols_) * (static_cast<std::size_t>(height / (2 * radius)) + 1)),
        features_(features) {
    for (std::uint32_t k = 0; k < features.size(); ++k)
      cells_[static_cast<std::size_t>(row(features[k].pixel.y())) * cols_ + column(features[k].pixel.x())].push_back(k);
  }

  /// Calls `visit` with the index of each feature around `uv`.
  template <class Visit>
  void around(const Eigen::Vector2d& uv, Visit visit) const {
    for (int r = row(uv.y() - radius_); r <= row(uv.y() + radius_); ++r)
      for (int c = column(uv.x() - radius_); c <= column(uv.x() + radius_); ++c)
        for (const std::uint32_t k : cells_[static_cast<std::size_t>(r) * cols_ + c])
          if ((features_[k].pixel.cast<double>() - uv).norm() <= radius_) visit(k);
  }

 private:
  int column(double u) const { return cellOf(u, cols_); }
  int row(double v) const { return cellOf(v, static_cast<int>(cells_.size()) / cols_); }
  int cellOf(double at, int cells) const { return static_cast<int>(std::clamp(at / (2 * radius_), 0.0, cells - 1.0)); }

  double radius_;
  int cols_;
  std::vector<std::vector<std::uint32_t>> cells_;
  const std::vector<Feature>& features_;
};

}  // namespace vip_slam
