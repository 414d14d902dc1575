// SPDX-License-Identifier: BSD-3-Clause
// How much more probable it is that two keyframes show one place than that they show two places that look alike, from
// how much of the image the match explains and from where the map expected it. Natural logarithms of likelihood ratios.
#pragma once

#include <Eigen/Core>

#include "vip_slam_backend/loop/place_coverage.h"

namespace vip_slam {

/// From the share of the image's cells in sight of the map that the match explains, not of the features, since in
/// blurred images few corners are found again: beta-binomial for a true place against one for wrong places, so that few
/// cells say little; some wrong places look just as the true one does. At most 4.
double matchEvidence(const PlaceCoverage& coverage);

/// From the pose. `chi2`: what it costs the graph's four degrees of freedom; `position_covariance`: of the relative
/// position, odometry and loop together, m^2; `extent`: metres over which a wrong place may lie. A true place follows
/// a Student t distribution with four degrees of freedom, since sigmas of odometry are themselves known to a factor
/// only; a wrong one may lie anywhere along a line and face any of four ways: places that look alike stand in rows and
/// are seen from one height. Where the map knows the place to a centimetre and finds it there, eight or so; ten sigmas
/// off, -5.
double poseEvidence(double chi2, const Eigen::Matrix3d& position_covariance, double extent);

}  // namespace vip_slam
