// SPDX-License-Identifier: BSD-3-Clause
// Parameters of the back-end nodelet in addition to those of the estimator.
#pragma once

#include <string>

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct BackEndNodeOptions {
  BackEndOptions back_end;
  std::string sensor;
  std::string map_frame = "map";
  std::string odom_frame = "odom";
  std::string load_map;
  bool localisation_mode = false;
  std::string rtabmap_services = "rtabmap";
  std::string backup_path = "vip_slam_backup.vsm";
  bool publish_tf = true;
  int keyframe_queue = 50;

  void visit(OptionVisitor& v) {
    v.field("sensor", sensor, {}, "a shipped sensor or the path of a sensor YAML file");
    v.field("map_frame", map_frame, {}, "tf frame of the map");
    v.field("odom_frame", odom_frame, {}, "tf frame of the odometry");
    v.field("load_map", load_map, {}, "map file to start with; empty: a new map");
    v.field("localisation_mode", localisation_mode, "use the map without changing it");
    v.field("rtabmap_services", rtabmap_services, {}, "namespace of services named as RTAB-Map's; empty: none");
    v.field("backup_path", backup_path, {}, "file of the backup service; relative: to ~/.ros under roslaunch");
    v.field("publish_tf", publish_tf, "publish map -> odom");
    v.field("keyframe_queue", keyframe_queue, 2, 1000, "keyframes that may wait");
    back_end.visit(v);
  }
};

}  // namespace vip_slam
