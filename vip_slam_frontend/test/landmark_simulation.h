// SPDX-License-Identifier: BSD-3-Clause
// A body on a smooth path in a box-shaped room whose walls carry points; IMU samples and noisy sightings of the points
// (pixels and depth) without rendering. Everything random comes from the seed.
#pragma once

#include <random>
#include <vector>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_frontend/filter/vio_filter.h"

namespace vip_slam::testing {

struct SimulationOptions {
  std::uint32_t seed = 1;
  double sigma_px = 0.5;
  double focal = 500;
  double imu_rate = 200, image_rate = 20;
  double depth_a = 0.002, depth_c = 0.002;  ///< sigma = a + c z^2
  double depth_told = 1.0;                  ///< share of that sigma reported to the filter
  double depth_offset = 0;                  ///< m, added to all readings
  double depth_scale = 1;                   ///< factor of all readings
  double depth_delay = 0;                   ///< s by which depth shows an earlier moment than the pixels
  double readout = 0;                       ///< s in which the rows of an image are read, the middle one at the stamp
  /// Shift of the depth image against the colour image, right and down, in bearings.
  Eigen::Vector2d depth_shift = Eigen::Vector2d::Zero();
  BearingCorrection bearing;  ///< error of the intrinsics: the sightings need this correction
  bool depth = true;
  bool imu_noise = true;
  int points = 1200;
  double outlier_ratio = 0;
  /// Tracks that are not fixed points: each creeps at its own constant rate, drawn with this sigma, px per image.
  double creep_px = 0;
  double creep_ratio = 0;  ///< share of such tracks
  double speed = 1.0;      ///< factor on the motion's frequencies; 0: standing
  ImuNoise noise{1.7e-3, 2e-5, 2e-2, 3e-4};
  Eigen::Matrix3d gyro_error = Eigen::Matrix3d::Zero();  ///< it measures (I + this) * omega
  double noise_told = 1.0;                               ///< share of the IMU's noise reported to the filter
  double time_offset = 0;                                ///< t_imu = t_image + time_offset
  double later_time_offset = 0;                          ///< replaces time_offset from `later` on
  double later = 1e9;                                    ///< s
  std::size_t most_points = 200;                         ///< in view at a time
  double blind_from = 1e9, blind_until = 1e9;            ///< s: no point is seen, the tracks end
};

class LandmarkSimulation {
 public:
  explicit LandmarkSimulation(const SimulationOptions& options);

  /// True pose and velocity, and the random-walk biases.
  NavState stateAt(double t) const;
  /// Noisy samples covering [t0, t1] on the fixed IMU raster.
  const std::vector<ImuSample>& imu() const { return imu_; }
  std::vector<ImuSample> imuBetween(double t0, double t1) const;
  /// Noisy sightings at IMU time t of at most `most` points; a point keeps its track id while it stays in view.
  std::vector<FilterMeasurement> sight(double t, std::size_t most);
  /// Corrects depth readings for this shift and this delay (s) from now on.
  void readDepthWith(const Eigen::Vector2d& shift, double delay) { read_with_ = shift, read_late_ = delay; }
  /// Takes sightings to the stamp with this readout, s, from now on.
  void readRowsWithin(double seconds) { read_within_ = seconds; }
  const SE3& T_I_C() const { return T_I_C_; }
  void generateImu(double until);

 private:
  SE3 poseAt(double t) const;
  SimulationOptions options_;
  std::mt19937 random_;
  SE3 T_I_C_;
  std::vector<Eigen::Vector3d> points_;
  Eigen::Vector2d read_with_ = Eigen::Vector2d::Zero();
  double read_late_ = 0;
  double read_within_ = 0;
  std::vector<LandmarkId> track_;
  std::vector<Eigen::Vector2d> creep_, crept_;  ///< px per image, px; per point
  LandmarkId next_ = 1;
  std::vector<ImuSample> imu_;
  std::vector<Eigen::Vector3d> bias_gyro_, bias_accel_;
};

struct RunResult {
  double nees = 0;            ///< mean over time of the 6-DoF pose error's normalised square (expectation 6)
  double final_position = 0;  ///< m
  double final_rotation = 0;  ///< rad
  double final_velocity = 0;  ///< m/s
  double length = 0;          ///< m travelled
  double nis_per_dof = 0;
  double depth_noise_scale = 1;  ///< factor on the depth noise estimated by the filter, at the end
  /// Motions over 8 and 20 images in turn, as between keyframes: mean NEES (expectation 6), sum of the error lengths
  /// (m), and that sum for the difference of the two poses at the time when each was the newest.
  double motion_nees = 0, motion_error = 0, newest_error = 0;
  int gated = 0, used = 0;
  WindowState window;  ///< at the end
  CalibrationEstimate calibration;
  double most_depth_correction = 0;                           ///< m, of all images, with its sign
  Eigen::Vector2d depth_shift = Eigen::Vector2d::Zero();      ///< applied, at the end
  double most_bearing_correction = 0;                         ///< passed on, largest entry of all images
  Eigen::Matrix3d gyro_correction = Eigen::Matrix3d::Zero();  ///< passed on, at the end
  double most_gyro_correction = 0;                            ///< its largest entry of all images
  Matrix15d covariance = Matrix15d::Zero();                   ///< the filter's
  Matrix15d covariance_of_scale = Matrix15d::Zero();
};

/// For this simulation: its depth readings are single pixels, not medians, and its pixel errors independent.
FilterOptions singlePixels();

/// Runs the filter over `seconds` of the simulation from a start drawn from its own prior.
RunResult runFilter(const SimulationOptions& simulation, const FilterOptions& filter, double seconds, bool standing,
                    const SE3& extrinsic_error = SE3(), double time_offset_guess = 0);

}  // namespace vip_slam::testing
