// SPDX-License-Identifier: BSD-3-Clause
// Regions of an image that move independently of the camera, from its tracks: around a point that does not follow the
// camera's motion and at about its depth, when no static point is nearer.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace vip_slam {

/// Whether the gate's share of mismatches explains so many outliers of a number of points (Poisson).
bool areMismatches(int outliers, int points);

class MovingRegions {
 public:
  /// A tracked point of the image, its depth in metres (0: none), and whether the camera's motion explains it.
  void add(const Eigen::Vector2f& pixel, double z, bool still);
  /// Whether the surface at `pixel` with depth `z`, m (0: unknown), moves. False everywhere when only a few points do
  /// not follow the camera's motion: those are mismatches.
  bool moves(const Eigen::Vector2d& pixel, double z) const;
  /// Whether there are more moving points than mismatches explain.
  bool any() const;

 private:
  struct Mark {
    Eigen::Vector2f pixel;
    float z;
  };
  /// Squared distance to the nearest mark, px^2.
  static float nearest(const std::vector<Mark>& marks, const Eigen::Vector2f& pixel, const Mark** mark);

  std::vector<Mark> still_, moving_;
};

}  // namespace vip_slam
