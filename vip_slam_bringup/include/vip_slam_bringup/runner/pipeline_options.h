// SPDX-License-Identifier: BSD-3-Clause
// All options of the estimators, with the names used by run_bag and the parameter reference.
#pragma once

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_core/util/options.h"
#include "vip_slam_frontend/front_end_options.h"
#include "vip_slam_planes/plane_mapper_options.h"
#include "vip_slam_ros/input_options.h"

namespace vip_slam {

struct PipelineOptions {
  FrontEndOptions frontend;
  PlaneMapperOptions planes;
  BackEndOptions backend;
  bool mapping = true;
  int lag = 3;
  InputOptions input;

  void visit(OptionVisitor& v) {
    v.group("frontend", frontend);
    v.group("planes", planes);
    v.group("backend", backend);
    v.field("mapping", mapping, "run planes and back end; without them only the odometry is written");
    v.field("lag", lag, 0, 100,
            "images after a keyframe at which the front end hears of the map's answer; 0: waits for it at once");
    input.visit(v);
  }
};

}  // namespace vip_slam
