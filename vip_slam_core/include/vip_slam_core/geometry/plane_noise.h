// SPDX-License-Identifier: BSD-3-Clause
// What one keyframe's depth points on a plane are worth, and how they agree with their plane.
//
// The points' errors along the plane's normal have two parts: white ones, and one that the whole surface shares in that
// keyframe (depth cameras err by millimetres over patches of many degrees). With points p~_i = (p_i, 1), whitened by
// their sigmas, a plane u = (n, d) in the camera has the residuals P u + P B s + white. The columns of B move the
// surface as a whole: along its normal, and by a turn about each of its two axes; s ~ N(0, S) are the shared errors.
// Without s the information on u is, by Woodbury,
//   G' = P^T (I + P B S B^T P^T)^-1 P = G - G B (S^-1 + B^T G B)^-1 B^T G,   G = P^T P = sum p~ p~^T / sigma^2.
// About the centroid, and with turns scaled by the points' extent along the axes, B^T G B = w I, w = G(3, 3). So the
// three directions separate: the variance of the distance is 1/w + shared^2, of each turn (1/w + shared^2 / 3) over the
// extent squared; the third makes an error at the border of a uniform surface that is as large as the shared one. N
// readings are not worth N.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// The two parts of one observation's noise, along its plane's normal.
struct SurfaceNoise {
  double white = 1;   ///< factor on the variance of its samples
  double shared = 0;  ///< variance that all of them have in common in one image, m^2
};

/// `G`: sum of p~ p~^T / sigma^2 over `count` samples, in the camera; `n_C`: the plane's normal there. Of samples that
/// say nothing the white factor is 1, and nothing is shared.
SurfaceNoise surfaceNoise(const Eigen::Matrix4d& G, std::size_t count, const Eigen::Vector3d& n_C,
                          const DepthNoise& model, const DepthNoiseParts& parts);

/// The map of homogeneous points p~ for which G' = T G T^T: the centroid's weight and the extent shrink, and the points
/// move onto their own plane, since their scatter about it tells nothing of where it is. `shared`: variance, m^2.
/// Identity when G is zero.
Eigen::Matrix4d sharedErrorShrinkage(const Eigen::Matrix4d& G, double shared);

/// Chi-square of the distance and tilt (three degrees of freedom) between the plane (n, d) in the observation's camera
/// and the best plane through the points of G, without the points' own scatter.
double planeMisfit(const Eigen::Matrix4d& G, const Eigen::Vector4d& plane_C);

/// Misfit of one keyframe's observation of a plane, which is given by an index.
struct PlaneMisfit {
  int plane;
  double misfit;
  double square = 0;  ///< the same per point, m^2: mean squared distance from the plane
};

/// Factors on the information of single planes. One plane may represent several surfaces: fronts of boxes
/// on a shelf, offset by a hand's breadth, turned by a few degrees. Each keyframe sees other parts of it, and the error
/// is common to most of its observations. So its variance, in units of the map's typical misfit, is unknown with a
/// prior, which makes its misfits jointly Student's t. By index of plane; 1 for planes without observations, and for
/// all with too few observations.
std::vector<double> planeWeights(const std::vector<PlaneMisfit>& misfits, std::size_t planes);

/// Whether each plane, by index, is one surface. It is not when its median misfit is ten times the typical one of the
/// map, more than the noise model expects, and more than the unevenness of real walls. (Single keyframes that saw
/// another surface next to it have no influence on the median.) True for all with too few observations.
std::vector<char> planesAgree(const std::vector<PlaneMisfit>& misfits, std::size_t planes);

}  // namespace vip_slam
