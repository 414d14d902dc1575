// The start. Standing: gravity and biases from a second of rest. Moving: camera poses against the first image from its
// points with depth (metric), gyro bias from their rotations, then velocity and gravity from their translations.
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

  /// Adds one image; the prior of the start once there is enough, holding at that image's time.
  std::optional<FilterPrior> add(const InitialisationInput& image, const ImuBuffer& imu);
  /// Why it is still waiting.
  const std::string& reason() const { return reason_; }
  /// What is known of them by now, instead of the configuration: T_I_C, and of the gyro as in
  /// core/imu/gyro_correction.h.
  void setMounting(const SE3& T_I_C, const Eigen::Matrix3d& gyro_correction);
  void reset();

 private:
  std::optional<FilterPrior> standing(const ImuBuffer& imu);
  std::optional<FilterPrior> moving(const ImuBuffer& imu);
  /// Poses of all images against the first; when too little of the first is left in view, a later one takes its place.
  /// False where an image shows too little of the one before, which is then `broken`.
  bool chainPoses(std::vector<TimedCameraPose>* poses, std::size_t* broken);
  /// From that image to the newest one.
  bool depthMoved(const InitialisationInput& since) const;
  bool turnsOver(std::size_t oldest);

  InitialisationOptions options_;
  FilterOptions filter_;
  ImuNoise noise_;
  SE3 T_I_C_;
  Eigen::Matrix3d gyro_correction_ = Eigen::Matrix3d::Zero();
  double focal_, gravity_;
  DepthNoise depth_noise_;
  bool weighs_wrong_ = false;   ///< at rest, and not with a body's weight: no start is possible
  bool watches_rest_ = false;   ///< the IMU is quiet, whether the camera stands will show
  double next_try_t_ = -1e300;  ///< of a start in motion, IMU time
  int replaced_in_a_row_ = 0;   ///< images that shared nothing with any before them
  std::deque<InitialisationInput> images_;
  std::string reason_ = "waiting for images and IMU", refusal_;
};

/// Mean image motion in pixels of features common to both; -1 when fewer than five are.
double meanDisparity(const std::vector<FilterMeasurement>& a, const std::vector<FilterMeasurement>& b, double focal_px);

/// Length of the mean of their motions, likewise: next to nothing when they go this way and that.
double meanShift(const std::vector<FilterMeasurement>& a, const std::vector<FilterMeasurement>& b, double focal_px);

/// Median change of depth at the grid's pixels, in sigmas of a single reading; -1 when fewer than thirty of them have
/// depth in both.
double depthChange(const DepthGrid& a, const DepthGrid& b, const DepthNoise& noise);

/// Levelled prior from the mean of a rest; pure function of the samples.
FilterPrior standingPrior(const std::vector<ImuSample>& samples, const FilterOptions& options, const ImuNoise& noise,
                          double gravity);

/// Moves the start so that base_link, not the IMU, begins at the origin and heads along x; gravity stays where it is.
void startAtBase(const SE3& T_base_imu, FilterPrior* prior);

}  // namespace vip_slam
