// SPDX-License-Identifier: BSD-3-Clause
// Options of the sliding-window filter, its calibration states and zero-velocity updates.
#pragma once

#include "vip_slam_core/util/options.h"

namespace vip_slam {

/// Which calibration of camera and gyro is estimated online. There is no threshold of motion below which it is frozen,
/// since leaving the calibration out of an update treats it as exact there, which a filter cannot undo later. Only the
/// delay is held (not left out) while the gyro does not change: a steady turn tells it from nothing else. Numbers whose
/// evidence is gathered beside the filter (CalibrationEvidence) are held at adopted values all the time.
struct CalibrationOptions {
  bool rotation = true;
  bool translation = false;
  bool time_offset = true;
  bool depth_offset = true;
  bool depth_scale = true;
  bool depth_delay = true;
  bool readout = true;
  bool intrinsics = true;
  bool depth_shift = true;
  bool gyro_scale = true;
  bool gyro_misalignment = false;
  double sigma_rotation = 0.01;
  double sigma_translation = 0.01;
  double sigma_time_offset = 0.005;
  double sigma_depth_offset = 0.005;
  double sigma_depth_scale = 0.02;
  double sigma_depth_delay = 0.015;
  double sigma_readout = 0.015;
  double sigma_focal = 0.005;
  double sigma_aspect = 0.0005;
  double sigma_centre = 0.002;
  double sigma_depth_shift = 0.003;

  void visit(OptionVisitor& v) {
    v.field("rotation", rotation, "estimate the camera-IMU rotation online");
    v.field("translation", translation, "estimate the camera-IMU translation online");
    v.field("time_offset", time_offset, "estimate the camera-IMU delay online");
    v.field("depth_offset", depth_offset, "estimate online what all depth readings are too long or too short by");
    v.field("depth_scale", depth_scale, "estimate online the factor that depth readings need");
    v.field("depth_delay", depth_delay, "estimate online how much later depth is stamped than it was seen");
    v.field("readout", readout, "estimate online within what time the rows of a colour image are read");
    v.field(
        "intrinsics", intrinsics,
        "estimate online what focal lengths and principal point are off by; not of a fisheye, nor where depth is not "
        "registered");
    v.field("depth_shift", depth_shift,
            "estimate online how far the depth image lies beside the colour image; not of a fisheye");
    v.field("gyro_scale", gyro_scale, "estimate online the scale of the gyro's axes");
    v.field("gyro_misalignment", gyro_misalignment, "estimate online the misalignment of the gyro's axes");
    v.field("sigma_rotation", sigma_rotation, 1e-5, 1.0, "initial one-sigma of the rotation, rad");
    v.field("sigma_translation", sigma_translation, 1e-5, 1.0, "initial one-sigma of the translation, m");
    v.field("sigma_time_offset", sigma_time_offset, 1e-6, 1.0, "initial one-sigma of the delay, s");
    v.field("sigma_depth_offset", sigma_depth_offset, 1e-6, 1.0, "initial one-sigma of the depth's offset, m");
    v.field("sigma_depth_scale", sigma_depth_scale, 1e-6, 1.0, "initial one-sigma of the depth's scale");
    v.field("sigma_depth_delay", sigma_depth_delay, 1e-6, 1.0, "initial one-sigma of the depth's delay, s");
    v.field("sigma_readout", sigma_readout, 1e-6, 1.0, "initial one-sigma of the time in which rows are read, s");
    v.field("sigma_focal", sigma_focal, 1e-6, 1.0, "initial one-sigma of the focal lengths, as a share of them");
    v.field("sigma_aspect", sigma_aspect, 1e-6, 1.0, "initial one-sigma of fx / fy");
    v.field("sigma_centre", sigma_centre, 1e-6, 1.0,
            "initial one-sigma of the principal point, as a share of the focal length");
    v.field(
        "sigma_depth_shift", sigma_depth_shift, 1e-6, 1.0,
        "initial one-sigma of how far the depth image lies beside the colour image, as a share of the focal length");
  }
};

/// Standing still. The limits of the IMU depend on the body's vibrations.
struct ZuptOptions {
  bool enabled = true;
  double max_gyro_std = 0.02;
  double max_accel_std = 0.25;

  void visit(OptionVisitor& v) {
    v.field("enabled", enabled, "zero-velocity updates while standing still");
    v.field("max_gyro_std", max_gyro_std, 0.0, 1.0, "largest gyro deviation while still, rad/s");
    v.field("max_accel_std", max_accel_std, 0.0, 10.0, "largest accelerometer deviation while still, m/s^2");
  }
};

struct FilterOptions {
  int window = 11;
  double sigma_px = 0.5;
  double sigma_px_min = 0.11;
  double pixel_inflation = 1.3;
  bool own_noise = true;
  double pull_huber = 1.0;
  int max_update_features = 30;
  double depth_inflation = 1.4;
  bool adapt_imu_noise = true;
  double sigma_bias_gyro = 0.02;
  double sigma_bias_accel = 0.1;
  CalibrationOptions calibration;
  ZuptOptions zupt;

  void visit(OptionVisitor& v) {
    v.field("window", window, 4, 30, "clones kept");
    v.field("sigma_px", sigma_px, 0.05, 10.0, "one-sigma of a well textured patch's pixel at the start, px");
    v.field("sigma_px_min", sigma_px_min, 0.01, 10.0,
            "lower bound of the adaptation, px; the error that good tracks share");
    v.field("pixel_inflation", pixel_inflation, 1.0, 20.0,
            "factor on the adapted sigma_px; above 1: what a track errs in one image it errs in the next, too");
    v.field("own_noise", own_noise, "a feature whose residuals sigma_px does not explain gets a larger one of its own");
    v.field("pull_huber", pull_huber, 0.1, 1000.0,
            "Huber threshold on the correction that one feature asks for, in sigmas of what it may");
    v.field("max_update_features", max_update_features, 5, 500, "features used by one update");
    v.field("depth_inflation", depth_inflation, 0.1, 20.0,
            "factor on the depth noise; above 1: what a corner's depth errs in one image it errs in the next, too");
    v.field("adapt_imu_noise", adapt_imu_noise, "widen the IMU noise while the images contradict the IMU");
    v.field("sigma_bias_gyro", sigma_bias_gyro, 1e-5, 1.0, "initial one-sigma of the gyro bias, rad/s");
    v.field("sigma_bias_accel", sigma_bias_accel, 1e-4, 5.0, "initial one-sigma of the accelerometer bias, m/s^2");
    v.group("calibration", calibration);
    v.group("zupt", zupt);
  }
};

}  // namespace vip_slam
