// SPDX-License-Identifier: BSD-3-Clause
// Sub-pixel alignment of a patch with its first appearance (inverse compositional Lucas-Kanade over shift and
// brightness). It removes the drift of frame-to-frame tracking, a few hundredths of a pixel per image.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vip_slam_frontend/tracking/patch_surface.h"

namespace vip_slam {

struct PatchAlignment {
  bool ok = false;
  bool wide = false;  ///< found with the wide patch
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double residual = 0;                                ///< root mean square after gain and offset, grey levels
  Eigen::Matrix2d texture = Eigen::Matrix2d::Zero();  ///< see patchTexture, of the warped patch in `current`'s pixels
};

/// Sum of the gradient products over the narrow or wide patch around `pixel`, (grey levels / px)^2, without the mean
/// gradient since brightness is estimated as well. Divided by the variance of a grey level it is the information of the
/// patch's position. Zero outside the image.
Eigen::Matrix2d patchTexture(const cv::Mat& image, const Eigen::Vector2d& pixel, bool wide = false);

/// Finds in `current` the patch that `reference` shows at `reference_pixel`. `warp` maps pixel offsets of the current
/// image into the reference. Starts at `start`; not ok when it leaves the image or does not converge. `wide`: use the
/// wide patch where that succeeds.
PatchAlignment alignPatch(const cv::Mat& reference, const Eigen::Vector2d& reference_pixel, const PatchWarp& warp,
                          const cv::Mat& current, const Eigen::Vector2d& start, bool wide = false);

}  // namespace vip_slam
