// How well the poses of an RGB-D folder are known, and what noise an IMU has that was made from them.
//
// An IMU synthesised from measured poses carries their errors: jitter from pose to pose becomes noise of rate and
// acceleration, and a slow drift of the poses contradicts the images. A sensor file has to say so, or the estimators
// believe such an IMU more than the images.
#pragma once

#include <vector>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_sim/io/rgbd_folder.h"

namespace vip_slam {

/// One sigma of an axis.
struct PoseError {
  double rotation = 0;  ///< rad
  double position = 0;  ///< m
};

/// Errors that differ from pose to pose, from the poses alone: what fourth differences hold beyond smooth motion,
/// robustly. Zero for fewer than 20 poses.
PoseError poseJitter(const Trajectory& poses);

/// Median time from pose to pose, and from image to image, s.
double poseInterval(const Trajectory& poses);
double imageInterval(const RgbdFolder& folder);

/// The widest spacing of knots, in steps from one to six pose intervals, at which a spline fitted with `iterations`
/// stays within the poses' jitter: wider ones cut the motion itself, narrower ones follow noise.
double splineSpacing(const Trajectory& poses, const PoseError& jitter, int iterations);

/// Motion between two depth images by the poses against the same motion by the images.
struct DepthDisagreement {
  double lag = 0;  ///< s
  int pairs = 0;   ///< 0: too few pairs of images with surfaces in three directions; the errors are void then
  PoseError error;
};

/// Registers pairs of depth images `lags` seconds apart, point to plane, beginning at the poses `T_W_C` of the colour
/// camera (those of the folder, or what was made of them).
std::vector<DepthDisagreement> posesAgainstDepth(const RgbdFolder& folder, const Trajectory& T_W_C,
                                                 const std::vector<double>& lags);

/// Poses of the colour camera at the images, mended by the depth images: relative poses of images up to two seconds
/// apart from registration, the given ones between neighbours (one sigma: `jitter`), and each given pose itself (one
/// sigma: `drift`).
Trajectory refinePoses(const RgbdFolder& folder, const PoseError& jitter, const PoseError& drift);

/// `sensor` (its own noise) and what poses with this jitter, seen at images `interval` seconds apart, and with this
/// drift add to an IMU that is made from them. `gravity` in m/s^2.
ImuNoise noiseOfImuFromPoses(const ImuNoise& sensor, const PoseError& jitter, double interval,
                             const std::vector<DepthDisagreement>& drift, double gravity = 9.81);

}  // namespace vip_slam
