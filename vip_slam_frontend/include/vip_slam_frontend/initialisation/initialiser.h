// SPDX-License-Identifier: BSD-3-Clause
// The start: the filter's first state from the first usable images, moving or still, with sigmas wide enough for what a
// fraction of a second cannot tell; the filter itself sharpens them. Level: by the mean specific force, else by a
// floor, else as the camera's axes are. Velocity and rate: by the motion between the images (dense_alignment.h). No
// misfit refuses a start. Without any usable image (darkness) a body that rests by its IMU starts as well.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "vip_slam_frontend/filter/vio_filter.h"
#include "vip_slam_frontend/inertial/inertial_input.h"
#include "vip_slam_frontend/initialisation/floor_level.h"
#include "vip_slam_frontend/initialisation/initialisation_options.h"

namespace vip_slam {

struct InitialisationInput {
  double t_imu = 0;
  int points = 0;                         ///< tracked points with depth
  bool surfaces = false;                  ///< enough flat patches in the depth image
  std::optional<Eigen::Vector3d> up;      ///< in the camera, by a floor in view; asked where no accelerometer tells it
  std::optional<SE3> T_current_previous;  ///< camera motion since the image before, where the images tell it
};

class Initialiser {
 public:
  Initialiser(const InitialisationOptions& options, const FilterOptions& filter, const ImuNoise& noise,
              const SE3& T_I_C, double gravity);

  /// Adds one image. Returns the filter's prior at that image's time once there is enough data.
  std::optional<FilterPrior> add(const InitialisationInput& image, const frontend::InertialInput& inertial);
  /// What the last prior's vertical is taken from.
  frontend::Level level() const { return level_; }
  /// Why it is still waiting.
  const std::string& reason() const { return reason_; }
  /// What is wrong with the accelerometer, so that the last prior's vertical is not taken from it; empty: nothing.
  const std::string& accelerometerFault() const { return accelerometer_fault_; }
  /// Extrinsics as estimated so far, instead of the configured ones.
  void setExtrinsics(const SE3& T_I_C) { T_I_C_ = T_I_C; }
  void reset();

 private:
  /// The prior at rest, from the IMU alone.
  std::optional<FilterPrior> standing(double t, const frontend::InertialInput& inertial);

  InitialisationOptions options_;
  FilterOptions filter_;
  ImuNoise noise_;
  SE3 T_I_C_;
  double gravity_;
  std::deque<InitialisationInput> images_;  ///< usable ones in a row
  frontend::Level level_ = frontend::Level::kAccelerometer;
  std::string reason_ = "waiting for images and IMU";
  std::string accelerometer_fault_;
};

/// Changes the prior's position and yaw so that base_link, not the IMU, starts at the origin, heading along x.
void startAtBase(const SE3& T_base_imu, FilterPrior* prior);

}  // namespace vip_slam
