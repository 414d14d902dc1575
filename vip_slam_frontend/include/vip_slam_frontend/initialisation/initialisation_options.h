// Options of the initialisation, standing or moving.
#pragma once

#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct InitialisationOptions {
  double standing_seconds = 1.0;
  double moving_seconds = 1.2;
  double max_gyro_std = 0.03;
  double max_accel_std = 0.3;
  double max_disparity_px = 1.0;
  int min_tracks = 12;
  double max_gravity_error = 0.5;

  void visit(OptionVisitor& v) {
    v.field("standing_seconds", standing_seconds, 0.2, 20.0, "accelerometer time averaged for a standing start, s");
    v.field("moving_seconds", moving_seconds, 0.5, 3.0, "images gathered for a moving start, s");
    v.field("max_gyro_std", max_gyro_std, 0.0, 1.0, "largest gyro deviation of a standing start, rad/s");
    v.field("max_accel_std", max_accel_std, 0.0, 10.0, "largest accelerometer deviation of a standing start, m/s^2");
    v.field("max_disparity_px", max_disparity_px, 0.0, 20.0, "largest mean image motion of a standing start, px");
    v.field("min_tracks", min_tracks, 8, 1000, "features with depth that a moving start needs");
    v.field("max_gravity_error", max_gravity_error, 0.01, 5.0, "accepted error of the estimated gravity, m/s^2");
  }
};

}  // namespace vip_slam
