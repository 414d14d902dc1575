// Initialisation. Standing: gravity and biases from a second of rest. Moving: metric camera poses relative to the first
// image from its points with depth, gyro bias from their rotations, velocity and gravity from their translations.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/imu/imu_buffer.h"
#include "vip_slam_frontend/filter/vio_filter.h"
#include "vip_slam_frontend/initialisation/initialisation_options.h"
#include "vip_slam_frontend/initialisation/moving_start.h"

namespace vip_slam {

struct InitialisationInput {
  double t_imu = 0;
  std::vector<FilterMeasurement> features;
  DepthGrid depth = {};  ///< may be empty
};

class Initialiser {
 public:
  Initialiser(const InitialisationOptions& options, const FilterOptions& filter, const ImuNoise& noise,
              const SE3& T_I_C, double focal_px, double gravity, const DepthNoise& depth_noise = {});

  /// Adds one image. Returns the filter's prior at that image's time once there is enough data.
  std::optional<FilterPrior> add(const InitialisationInput& image, const ImuBuffer& imu);
  /// Why it is still waiting.
  const std::string& reason() const { return reason_; }
  /// Extrinsics and gyro correction (core/imu/gyro_correction.h) as estimated so far, instead of the configured ones.
  void setCalibration(const SE3& T_I_C, const Eigen::Matrix3d& gyro_correction);
  void reset();

 private:
  std::optional<FilterPrior> standing(const ImuBuffer& imu);
  std::optional<FilterPrior> moving(const ImuBuffer& imu);
  /// Poses of all images relative to the first; when too little of the base image is left in view, a later image
  /// becomes the base. False when an image has too few points in common with the one before; `broken` is its index.
  bool chainPoses(std::vector<TimedCameraPose>* poses, std::size_t* broken);
  /// Whether the depth images show motion between that image and the newest one.
  bool depthMoved(const InitialisationInput& since) const;
  bool turnsOver(std::size_t oldest);

  InitialisationOptions options_;
  FilterOptions filter_;
  ImuNoise noise_;
  SE3 T_I_C_;
  Eigen::Matrix3d gyro_correction_ = Eigen::Matrix3d::Zero();
  double focal_, gravity_;
  DepthNoise depth_noise_;
  bool weighs_wrong_ = false;   ///< at rest, but the specific force is not gravity's: no start is possible
  bool watches_rest_ = false;   ///< the IMU is quiet, the images do not show yet whether the camera stands
  double next_try_t_ = -1e300;  ///< next attempt of a start in motion, IMU time
  int replaced_in_a_row_ = 0;   ///< images in a row that shared no features with any before them
  std::deque<InitialisationInput> images_;
  std::string reason_ = "waiting for images and IMU", refusal_;
};

/// Mean image motion in pixels of features common to both; -1 when fewer than five are.
double meanDisparity(const std::vector<FilterMeasurement>& a, const std::vector<FilterMeasurement>& b, double focal_px);

/// Length of the mean motion vector of the same features, px or -1: close to zero when they move in all directions.
double meanShift(const std::vector<FilterMeasurement>& a, const std::vector<FilterMeasurement>& b, double focal_px);

/// Median change of depth at the grid's pixels, in sigmas of a single reading; -1 when fewer than thirty pixels have
/// depth in both.
double depthChange(const DepthGrid& a, const DepthGrid& b, const DepthNoise& noise);

/// Levelled prior from the mean IMU sample of a time at rest; pure function of the samples.
FilterPrior standingPrior(const std::vector<ImuSample>& samples, const FilterOptions& options, const ImuNoise& noise,
                          double gravity);

/// Changes the prior's position and yaw so that base_link, not the IMU, starts at the origin, heading along x.
void startAtBase(const SE3& T_base_imu, FilterPrior* prior);

}  // namespace vip_slam
