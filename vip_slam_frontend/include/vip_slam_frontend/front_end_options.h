// SPDX-License-Identifier: BSD-3-Clause
// All options of the front end, in groups.
#pragma once

#include "vip_slam_core/util/options.h"
#include "vip_slam_frontend/filter/filter_options.h"
#include "vip_slam_frontend/initialisation/initialisation_options.h"
#include "vip_slam_frontend/keyframes/keyframe_options.h"
#include "vip_slam_frontend/tracking/tracking_options.h"

namespace vip_slam {

/// What happens when measurements fail.
struct RecoveryOptions {
  double coast_seconds = 4.0;
  int min_tracks = 10;
  double max_imu_gap = 0.1;
  double max_image_gap = 10.0;
  double max_position_sigma = 2.0;

  /// Longest IMU gap over which the IMU is believed, s; in a longer one images and depth carry the pose.
  double longestImuGap() const { return 5.0 * max_imu_gap; }

  void visit(OptionVisitor& v) {
    v.field("coast_seconds", coast_seconds, 0.1, 60.0, "IMU-only time before LOST, s");
    v.field("min_tracks", min_tracks, 3, 500, "fewer tracks than this count as none");
    v.field(
        "max_imu_gap", max_imu_gap, 0.05, 5.0,
        "IMU gaps beyond this are bridged with more noise, s; from five times as long on by images and depth alone");
    v.field("max_image_gap", max_image_gap, 0.2, 25.0,
            "images missing for longer than this restart the tracking, s; until then the IMU carries the pose");
    v.field("max_position_sigma", max_position_sigma, 0.05, 100.0,
            "LOST when the position's sigma has grown by this without features, m; beyond, recovery is a new epoch");
  }
};

struct FrontEndOptions {
  TrackingOptions tracking;
  FilterOptions filter;
  InitialisationOptions initialisation;
  KeyframeOptions keyframes;
  RecoveryOptions recovery;
  int keyframe_grid_stride = 8;

  void visit(OptionVisitor& v) {
    v.group("tracking", tracking);
    v.group("filter", filter);
    v.group("initialisation", initialisation);
    v.group("keyframes", keyframes);
    v.group("recovery", recovery);
    v.field("keyframe_grid_stride", keyframe_grid_stride, 2, 64,
            "stride of the depth grid of a keyframe, px of 640, finer in smaller images; of other images twice that");
  }
};

}  // namespace vip_slam
