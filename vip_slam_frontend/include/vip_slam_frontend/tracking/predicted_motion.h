// SPDX-License-Identifier: BSD-3-Clause
// The camera's motion between two images as predicted by the IMU, for outlier rejection. When a person close to the
// camera fills the view, most points follow the person's motion; for some seconds the IMU is the better judge.
#pragma once

#include <cstdint>
#include <vector>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_frontend/tracking/outlier_rejection.h"

namespace vip_slam {

/// Number of images that a point must have been followed for to count as proven static.
constexpr std::uint32_t kOldPoint = 8;

/// For how long what has just been seen still holds, s: without depth, as images of a colour camera that is the faster
/// one are; without enough points; without images; after a fault of the IMU.
constexpr double kMoment = 0.5;

/// Errors of the motion between two images that no covariance has (blur, rolling shutter, delay, extrinsics) and that
/// two motions in a row share, one sigma: in each direction in rad and m, and as a share of the motion.
constexpr double kMotionError = 1e-3, kMotionErrorShare = 0.05;

struct PredictedMotion {
  SE3 T_current_previous;
  double sigma = 0;           ///< one sigma of the translation along its least certain axis, m
  double interval = 0;        ///< between the two images, s
  bool judges = false;        ///< it is sure enough to judge the points
  bool turn_unknown = false;  ///< the rotation is not known: the IMU had a gap
  bool wary = false;          ///< something moved a moment ago: in doubt prefer the IMU
  bool at_rest = false;  ///< the IMU has been at rest since the camera stood still: points that move are not static
};

/// Largest plausible distance of a translation from the predicted one, m.
double mostApart(const PredictedMotion& prediction);

/// Whether `found`, the motion that explains most pairs and that the IMU excludes, belongs to a moving body: fewer than
/// a quarter of its inliers are old points, or old points (at least a quarter as many) agree with the IMU. Old points
/// that all suddenly contradict the IMU are trusted: then the IMU, or the state, is wrong. `bounded`: the motion within
/// mostApart() of the predicted one that explains most pairs.
bool movesByItself(const std::vector<PointPair>& pairs, const RansacResult& found, const RansacResult& bounded);

/// Whether nearly all points agree with `found`, many of them old: a static scene does not start to move as a whole.
bool shownByAll(const std::vector<PointPair>& pairs, const RansacResult& found);

/// Outlier rejection that weighs `found` against `bounded`. `options.most_apart` is set here. `moves`: whether most of
/// the view moves independently of the camera; then only points that agree with the IMU are inliers.
RansacResult rejectOutliers(const std::vector<PointPair>& pairs, const PredictedMotion& prediction,
                            RansacOptions options, bool* moves);

}  // namespace vip_slam
