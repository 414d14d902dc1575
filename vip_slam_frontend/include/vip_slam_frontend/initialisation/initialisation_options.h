// Options of the start.
#pragma once

#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct InitialisationOptions {
  double seconds = 0.15;
  int min_points = 8;
  double standing_seconds = 1.0;
  double max_gyro_std = 0.03;
  double max_accel_std = 0.3;

  void visit(OptionVisitor& v) {
    v.field("seconds", seconds, 0.05, 3.0, "usable images gathered for a start, s");
    v.field("min_points", min_points, 4, 1000, "points with depth that make an image usable; or flat surfaces do");
    v.field("standing_seconds", standing_seconds, 0.2, 20.0,
            "rest by the IMU that a start without usable images needs, s");
    v.field("max_gyro_std", max_gyro_std, 0.0, 1.0, "largest gyro deviation at rest, rad/s");
    v.field("max_accel_std", max_accel_std, 0.0, 10.0, "largest accelerometer deviation at rest, m/s^2");
  }
};

}  // namespace vip_slam
