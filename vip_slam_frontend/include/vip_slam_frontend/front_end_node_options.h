// SPDX-License-Identifier: BSD-3-Clause
// Parameters of the front-end nodelet beside those of the estimator.
#pragma once

#include <string>

#include "vip_slam_core/util/options.h"
#include "vip_slam_frontend/front_end_options.h"
#include "vip_slam_ros/input_options.h"

namespace vip_slam {

struct FrontEndNodeOptions {
  FrontEndOptions front_end;
  std::string sensor;
  std::string image_transport;
  std::string depth_image_transport;
  std::string odom_frame = "odom";
  std::string base_frame = "base_link";
  std::string extrinsics = "auto";
  double tf_patience = 2.0;
  bool publish_tf = true;
  bool imu_rate_odometry = false;
  InputOptions input;
  int image_queue = 20;

  void visit(OptionVisitor& v) {
    v.field("sensor", sensor, {}, "a shipped sensor or the path of a sensor YAML file");
    v.field("image_transport", image_transport, {},
            "image_transport of the colour images: raw, compressed, or what is installed; empty: by the sensor file's "
            "topic");
    v.field("depth_image_transport", depth_image_transport, {},
            "likewise of the depth images: raw, compressedDepth, compressed (16-bit PNG)");
    v.field("odom_frame", odom_frame, {}, "tf frame of the odometry");
    v.field("base_frame", base_frame, {}, "tf frame of the robot; the IMU itself when nothing connects the two");
    v.field("extrinsics", extrinsics, {"auto", "tf", "config"},
            "where T_imu_cam and T_base_imu come from; auto: tf if it has them in time, else the sensor configuration");
    v.field("tf_patience", tf_patience, 0.0, 60.0, "how long auto waits for tf, s");
    v.field("publish_tf", publish_tf, "publish odom -> base_link");
    v.field("imu_rate_odometry", imu_rate_odometry, "publish odom_imu_rate, predicted at each IMU sample");
    input.visit(v);
    v.field("image_queue", image_queue, 1, 200, "images that may wait; older ones are dropped and counted");
    front_end.visit(v);
  }
};

}  // namespace vip_slam
