// SPDX-License-Identifier: BSD-3-Clause
// Parameters of the planes nodelet in addition to those of the estimator.
#pragma once

#include <string>

#include "vip_slam_core/util/options.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

struct PlanesNodeOptions {
  PlaneMapperOptions mapper;
  std::string sensor;
  std::string map_frame = "map";
  int keyframe_queue = 50;

  void visit(OptionVisitor& v) {
    v.field("sensor", sensor, {}, "a shipped sensor or the path of a sensor YAML file");
    v.field("map_frame", map_frame, {}, "tf frame of the map");
    v.field("keyframe_queue", keyframe_queue, 2, 1000, "keyframes and map updates that may wait");
    mapper.visit(v);
  }
};

}  // namespace vip_slam
