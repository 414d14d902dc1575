// SPDX-License-Identifier: BSD-3-Clause
// Accuracy of the poses of an RGB-D folder, and the noise of an IMU that is synthesised from them.
//
// An IMU synthesised from measured poses carries their errors: jitter from pose to pose becomes noise of rate and
// acceleration, and a slow drift of the poses contradicts the images. The noise in the sensor file has to cover both,
// or the estimators trust such an IMU more than the images.
#pragma once

#include <vector>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_sim/io/rgbd_folder.h"

namespace vip_slam {

/// One sigma per axis.
struct PoseSigma {
  double rotation = 0;  ///< rad
  double position = 0;  ///< m
};

/// Error that is independent from pose to pose, estimated robustly from the fourth differences of the poses, in which
/// smooth motion cancels. Zero for fewer than 20 poses.
PoseSigma poseJitter(const Trajectory& poses);

/// Median interval between poses, and between images, s.
double poseInterval(const Trajectory& poses);
double imageInterval(const RgbdFolder& folder);

/// The widest knot spacing (s), of one to six pose intervals, at which a spline fitted with `iterations` stays within
/// the poses' jitter: a wider one smooths the motion itself, a narrower one follows the noise.
double splineSpacing(const Trajectory& poses, const PoseSigma& jitter, int iterations);

/// Difference between the relative motion of two images from the poses and from registering their depth images.
struct DepthDisagreement {
  double lag = 0;  ///< s
  int pairs = 0;   ///< 0: too few pairs of images with surfaces in three directions; the errors are void then
  PoseSigma error;
};

/// Registers pairs of depth images `lags` seconds apart, point to plane, starting from the poses `T_W_C` of the colour
/// camera (those of the folder, or refined ones).
std::vector<DepthDisagreement> posesAgainstDepth(const RgbdFolder& folder, const Trajectory& T_W_C,
                                                 const std::vector<double>& lags);

/// Poses of the colour camera at the images, refined by a pose graph of: relative poses of images up to two seconds
/// apart from depth registration, the given motion between neighbours (one sigma: `jitter`), and each given pose itself
/// (one sigma: `drift`).
Trajectory refinePoses(const RgbdFolder& folder, const PoseSigma& jitter, const PoseSigma& drift);

/// Noise of an IMU synthesised from poses: its own (`sensor`) plus the noise equivalent to the poses' jitter over the
/// interval of the images (`interval`, s) and to their drift. `gravity` in m/s^2.
ImuNoise noiseOfImuFromPoses(const ImuNoise& sensor, const PoseSigma& jitter, double interval,
                             const std::vector<DepthDisagreement>& drift, double gravity = 9.81);

}  // namespace vip_slam
