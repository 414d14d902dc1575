// SPDX-License-Identifier: BSD-3-Clause
// The piece of surface that a patch shows. With its depth and slope the patch can be warped into another view to second
// order. On a wall seen at a flat angle a patch that is assumed to face the camera would drift.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_frontend/tracking/row_camera.h"

namespace vip_slam {

/// Share of a window's samples that need a reading.
constexpr double kMinValid = 0.6;

/// Half the side of a patch, px. The wide patch halves the variance of the match, but needs one plane over all of it.
constexpr int kNarrowPatch = 6, kWidePatch = 12;

/// Where a point without depth is put, m.
constexpr double kFarAway = 1e4;

/// A plane is affine in inverse depth over the image: 1/z(p + d) = (1 + slope . d) / depth.
struct PatchSurface {
  double depth = 0;                                 ///< z at the patch's centre, metres; 0: unknown, far away
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< 1/pixel; zero: facing the camera
  bool known = false;                               ///< one plane explains the depth readings of the whole patch
  bool wide = false;                                ///< ... and those of the wide patch as well

  double depthAt(const Eigen::Vector2d& offset_px) const { return depth / (1.0 + slope.dot(offset_px)); }
};

/// Surface around `pixel` in `depth_image` (32FC1, metres, 0 or NaN invalid), whose depth at the pixel is `depth`.
/// Fronto-parallel where the readings are too few or lie on no plane.
PatchSurface patchSurface(const cv::Mat& depth_image, const Eigen::Vector2d& pixel, double depth,
                          const DepthNoise& noise);

/// The same for the narrow patch alone.
PatchSurface narrowPatchSurface(const cv::Mat& depth_image, const Eigen::Vector2d& pixel, double depth,
                                const DepthNoise& noise);

/// Maps offsets from the patch's centre in the current image, px, to those in the reference. The second order matters:
/// averaged over a patch it is a shift along the motion, with the same sign for all patches of a wall or of a turn.
struct PatchWarp {
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
  Eigen::Vector2d xx = Eigen::Vector2d::Zero(), xy = xx, yy = xx;  ///< second derivatives, 1/px

  PatchWarp() = default;
  PatchWarp(const Eigen::Matrix2d& linear) : A(linear) {}  // NOLINT: a linear map is a warp
  Eigen::Vector2d operator()(double x, double y) const {
    return A.col(0) * x + A.col(1) * y + xx * (0.5 * x * x) + xy * (x * y) + yy * (0.5 * y * y);
  }
};

/// `reference` and `current`: the camera during either image. False when the patch is not visible or nearly edge-on.
bool patchWarp(const RowCamera& reference, const RowCamera& current, const Eigen::Vector2d& reference_pixel,
               const PatchSurface& surface, const SE3& T_cur_ref, PatchWarp* warp_ref_cur);

}  // namespace vip_slam
