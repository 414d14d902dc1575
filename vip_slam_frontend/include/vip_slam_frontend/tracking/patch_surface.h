// The small piece of surface that a patch shows. With its depth and slope the patch can be warped into another view to
// second order, also on a wall seen at a flat angle, where a patch taken to face the camera would creep.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_frontend/tracking/row_camera.h"

namespace vip_slam {

/// Half the side of a patch, px. The wide one halves the variance of where the patch is; it takes one plane all over
/// it.
constexpr int kNarrowPatch = 6, kWidePatch = 12;

/// A plane is affine in inverse depth over the image: 1/z(p + d) = (1 + slope . d) / depth.
struct PatchSurface {
  double depth = 0;                                 ///< z at the patch's middle, metres; 0: unknown, far away
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< 1/pixel; zero: facing the camera
  bool known = false;                               ///< one plane explains the depth readings of the whole patch
  bool wide = false;                                ///< ... of the wide one as well

  double depthAt(const Eigen::Vector2d& offset_px) const { return depth / (1.0 + slope.dot(offset_px)); }
};

/// Surface around `pixel` in `depth_image` (32FC1, metres, 0 or NaN invalid), whose depth in the middle is known to be
/// `depth`. Facing the camera where the readings are too few or lie on no plane.
PatchSurface patchSurface(const cv::Mat& depth_image, const Eigen::Vector2d& pixel, double depth,
                          const DepthNoise& noise);

/// The same over the narrow patch alone.
PatchSurface narrowPatchSurface(const cv::Mat& depth_image, const Eigen::Vector2d& pixel, double depth,
                                const DepthNoise& noise);

/// Offsets from the patch's middle in the current image, px, into those in the reference. The second order counts: over
/// a patch its mean is a shift in the direction of the motion, the same for all patches of a wall or of a turn.
struct PatchWarp {
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
  Eigen::Vector2d xx = Eigen::Vector2d::Zero(), xy = xx, yy = xx;  ///< second derivatives, 1/px

  PatchWarp() = default;
  PatchWarp(const Eigen::Matrix2d& linear) : A(linear) {}  // NOLINT: a linear map is a warp
  Eigen::Vector2d operator()(double x, double y) const {
    return A.col(0) * x + A.col(1) * y + xx * (0.5 * x * x) + xy * (x * y) + yy * (0.5 * y * y);
  }
};

/// `reference` and `current`: the camera during either image. False when the patch is out of sight or all but edge-on.
bool patchWarp(const RowCamera& reference, const RowCamera& current, const Eigen::Vector2d& reference_pixel,
               const PatchSurface& surface, const SE3& T_cur_ref, PatchWarp* warp_ref_cur);

}  // namespace vip_slam
