// SPDX-License-Identifier: BSD-3-Clause
// Patches that lie on one plane share its normal. A single patch is some centimetres wide and gives its normal to about
// a degree; measurement rows with such normals would falsely constrain the motion along a bare wall.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace vip_slam {

struct SurfacePatch {
  Eigen::Vector3d p_C = Eigen::Vector3d::Zero();   ///< camera frame, metres
  Eigen::Vector3d n_C = Eigen::Vector3d::Zero();   ///< unit normal towards the camera
  double sigma = 0;                                ///< one sigma of the plane's distance at p_C, metres, of white noise
  double sigma_normal = 0;                         ///< one sigma of the normal's direction, rad
  double reading = 0;                              ///< one sigma of a single reading's distance from the plane, metres
  Eigen::Vector2i cell = Eigen::Vector2i::Zero();  ///< place in the raster of patches
  int surface = -1;                                ///< number of its plane in the image; -1: not known yet
  double deviation = 0;                            ///< signed distance from that plane, metres
};

/// Finds planes among the patches and gives each patch on a plane the plane's normal and number. Patches on no plane
/// are dropped: the error of their own normals makes them noisy.
std::vector<SurfacePatch> shareNormals(std::vector<SurfacePatch> patches);

}  // namespace vip_slam
