// Options of feature detection, tracking and outlier rejection.
#pragma once

#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct TrackingOptions {
  int max_features = 200;
  double min_distance = 16.0;
  int grid_columns = 16;
  int grid_rows = 12;
  int fast_threshold = 16;
  int fast_threshold_low = 5;
  int klt_window = 15;
  int klt_levels = 3;
  int klt_iterations = 20;
  double forward_backward_px = 0.5;
  double ransac_px = 2.0;
  int ransac_iterations = 60;
  bool leave_out_moving = true;
  bool refine_against_reference = true;
  double reference_max_correction_px = 1.0;
  int border = 12;
  int keyframe_corners = 400;
  int landmark_hamming = 50;
  double landmark_radius_px = 8.0;

  void visit(OptionVisitor& v) {
    v.field("max_features", max_features, 20, 2000, "features tracked per image");
    v.field("min_distance", min_distance, 3.0, 200.0,
            "smallest distance between tracked features, px of an image of 640 x 480");
    v.field("grid_columns", grid_columns, 1, 64, "cells across the image for an even spread of corners");
    v.field("grid_rows", grid_rows, 1, 64, "cells down the image for an even spread of corners");
    v.field("fast_threshold", fast_threshold, 2, 100, "FAST threshold tried first, grey levels");
    v.field("fast_threshold_low", fast_threshold_low, 1, 100, "FAST threshold in cells where the first found nothing");
    v.field("klt_window", klt_window, 5, 51, "KLT window, px (odd)");
    v.field("klt_levels", klt_levels, 0, 8, "KLT pyramid levels above the image");
    v.field("klt_iterations", klt_iterations, 1, 100, "KLT iterations per level");
    v.field("forward_backward_px", forward_backward_px, 0.05, 10.0, "largest forward-backward error, px");
    v.field("ransac_px", ransac_px, 0.2, 20.0, "inlier threshold of outlier rejection, px");
    v.field("ransac_iterations", ransac_iterations, 10, 1000, "samples drawn by outlier rejection");
    v.field("leave_out_moving", leave_out_moving,
            "new points that contradict the IMU move by themselves: no part in pose, surfaces or keyframes");
    v.field("refine_against_reference", refine_against_reference,
            "align each tracked patch with the one of its reference image, so that long tracks do not creep");
    v.field("reference_max_correction_px", reference_max_correction_px, 0.1, 10.0,
            "largest shift the alignment with the reference patch may make, px");
    v.field("border", border, 4, 100, "no features nearer to the image border, px of an image of 640 x 480");
    v.field("keyframe_corners", keyframe_corners, 0, 5000, "untracked ORB corners added to a keyframe");
    v.field("landmark_hamming", landmark_hamming, 0, 256, "largest descriptor distance to re-acquire a landmark, bits");
    v.field("landmark_radius_px", landmark_radius_px, 1.0, 100.0, "search radius around a projected landmark, px");
  }
};

}  // namespace vip_slam
