// All options of the estimators, as run_bag and the parameter reference name them.
#pragma once

#include "vip_slam_core/util/options.h"
#include "vip_slam_frontend/front_end_options.h"

namespace vip_slam {

struct PipelineOptions {
  FrontEndOptions frontend;
  double imu_patience = 0.5;

  void visit(OptionVisitor& v) {
    v.group("frontend", frontend);
    v.field("imu_patience", imu_patience, 0.01, 10.0,
            "an image waits for the IMU to cover its stamp until other data is this much newer, s");
  }
};

}  // namespace vip_slam
