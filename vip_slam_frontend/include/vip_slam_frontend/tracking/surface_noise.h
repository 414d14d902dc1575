// SPDX-License-Identifier: BSD-3-Clause
// The two parts of a depth camera's noise, learnt from flat surfaces. White noise differs from patch to patch and
// averages out over a surface: it is what patches of two images differ by, offset and tilt of the surface apart. What
// neighbouring patches have in common (warped depth, disparity steps, multipath) does not average out: the part that
// varies within a surface is seen as the covariance of neighbours in single images, after a plane was fitted (in the
// terms of a variogram, its sill without the nugget); the part that the whole surface shares, which the fit absorbs,
// has been measured to be about as large (Kinect, Xtion, LiDAR phone). The motion does not enter, so that nothing that
// the odometry believes can hide the errors of the depth that it rests on.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_frontend/tracking/patch_grouping.h"

namespace vip_slam::frontend {

/// Two images' readings of one place on a surface.
struct SurfaceDifference {
  int surface = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< the place, in any frame, metres
  double distance = 0;                          ///< between the two along the normal, metres
  double reading = 0;                           ///< one sigma of it if each patch were a single reading, metres
};

class SurfaceNoise {
 public:
  /// Patches of one depth image on the planes that shareNormals() found.
  void addImage(const std::vector<SurfacePatch>& patches);
  void addDifferences(const std::vector<SurfaceDifference>& differences);

  /// One sigma of a patch's own error, as a factor on that of a single reading.
  double white() const { return std::sqrt(white_.value); }
  /// One sigma of the error that neighbouring readings of a surface in one image share, in the same unit: what is seen
  /// to vary within surfaces, and as much again that the plane's fit takes up.
  double shared() const { return std::sqrt(2 * std::max(0.0, shared_.value)); }
  /// Both as variances.
  DepthNoiseParts parts() const { return {white_.value, shared() * shared()}; }

 private:
  /// Mean over all items.
  struct Variance {
    double value;        ///< in squares of a reading's sigma
    double weight = 10;  ///< number of items behind it; at the start a poor camera is assumed
    void add(double mean, int count);
  };
  Variance white_{0.25}, shared_{1.0};
};

}  // namespace vip_slam::frontend
