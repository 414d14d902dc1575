// SPDX-License-Identifier: BSD-3-Clause
// What passes through the front end in one image: input, prediction, tracked, consistency, update. Assembled once, in
// this order; each step reads what those before it have filled in.
#pragma once

#include "vip_slam_frontend/filter/vio_filter.h"
#include "vip_slam_frontend/tracking/dense_alignment.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"

#include "parts/depth_input.h"
#include "parts/health.h"

namespace vip_slam::frontend {

struct ImageStep {
  // Input
  double t = 0, t_imu = 0;  ///< stamp on the image clock and on the IMU's, s
  cv::Mat gray;             ///< 8UC1
  DepthReading read;        ///< depth at its own stamp
  // Prediction
  double from = 0;          ///< time of the last state, IMU clock, s
  bool silent = false;      ///< there are no IMU samples since
  bool no_imu = false;      ///< likewise, or the sensor has no complete IMU
  bool gap = false;         ///< the IMU has a gap in between
  Propagation propagation;  ///< by what is believed
  SE3 T_odom_C;             ///< with it
  AlignedMotion moved;      ///< by all pixels; where they were not asked the motion that goes on
  bool by_images = false;   ///< all pixels were asked, and are believed before the IMU
  PredictedMotion by_imu;   ///< the camera's motion by the IMU
  cv::Mat depth;            ///< as seen at the image's stamp
  // Tracked
  TrackingResult tracked;
  // Update
  StepReport report;
  Sight sight;
};

}  // namespace vip_slam::frontend
