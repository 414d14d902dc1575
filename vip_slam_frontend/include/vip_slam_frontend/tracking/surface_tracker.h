// SPDX-License-Identifier: BSD-3-Clause
// Flat patches of one depth image, and where later depth images see the same surfaces: projective association of points
// to planes, the measurements behind surface_rows.h.
#pragma once

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_frontend/filter/surface_rows.h"
#include "vip_slam_frontend/tracking/moving_regions.h"
#include "vip_slam_frontend/tracking/patch_grouping.h"
#include "vip_slam_frontend/tracking/surface_noise.h"

namespace vip_slam {

class SurfaceTracker {
 public:
  /// `window`: number of images for which a reference lasts at most.
  SurfaceTracker(std::shared_ptr<const CameraModel> camera, const DepthNoise& noise, int window);

  /// Patches of an image, at most one per cell of the raster; none where the surface is not flat or belongs to a
  /// moving region.
  std::vector<SurfacePatch> patches(const cv::Mat& depth, const MovingRegions& moving = {}) const;
  /// Whether a depth image shows enough flat patches for matches to hold a motion.
  bool sees(const cv::Mat& depth) const;
  /// The image of `clone` becomes the reference, with those of its patches that lie on planes.
  void setReference(const cv::Mat& depth, CloneId clone, const MovingRegions& moving = {});
  void clear();
  CloneId reference() const { return reference_; }  ///< 0: none
  std::size_t size() const { return patches_.size(); }
  /// Pairs of the reference's patches with patches of `depth`, looked up where `T_cur_ref` (cameras) puts them. Both
  /// are fitted in the same way, so that the fit's systematic errors from noise and curvature cancel.
  SurfaceMatches match(const cv::Mat& depth, const SE3& T_cur_ref, const MovingRegions& moving = {});
  /// What the references so far have shown of the depth camera's noise; it outlives clear().
  const frontend::SurfaceNoise& learnt() const { return learnt_; }

 private:
  bool fit(const cv::Mat& depth, int u, int v, SurfacePatch* patch) const;

  std::shared_ptr<const CameraModel> camera_;
  DepthNoise noise_;
  std::vector<Eigen::Vector2f> undistorted_;  ///< of every pixel, row by row, z = 1; empty for a pinhole
  std::vector<SurfacePatch> patches_;
  frontend::SurfaceNoise learnt_;
  CloneId reference_ = 0;
  double window_;  ///< images matched with one reference
};

}  // namespace vip_slam
