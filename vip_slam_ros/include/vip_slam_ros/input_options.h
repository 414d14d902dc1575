// SPDX-License-Identifier: BSD-3-Clause
// How streams of images and IMU samples are brought together: the same live and offline.
#pragma once

#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct InputOptions {
  double pair_tolerance = 0.035;  ///< one period at 30 Hz
  double depth_patience = 0.15;
  double imu_patience = 0.5;
  double time_jump = 1.0;
  double max_lever_arm = 1.0;

  void visit(OptionVisitor& v) {
    v.field("pair_tolerance", pair_tolerance, 0.0, 0.5, "largest difference between colour and depth stamps, s");
    v.field("depth_patience", depth_patience, 0.0, 5.0,
            "a colour image waits for its depth until newer images are this far, s");
    v.field("imu_patience", imu_patience, 0.01, 10.0,
            "an image waits for the IMU to cover its stamp until other data is this much newer, s");
    v.field("time_jump", time_jump, 0.1, 60.0,
            "stamps this much older than the newest restart the odometry (looping bag), s");
    v.field("max_lever_arm", max_lever_arm, 0.01, 100.0,
            "a camera farther than this from the IMU is an error of the extrinsics, m");
  }
};

}  // namespace vip_slam
