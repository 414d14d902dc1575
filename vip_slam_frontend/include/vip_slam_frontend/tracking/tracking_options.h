// SPDX-License-Identifier: BSD-3-Clause
// Options of feature detection, tracking and outlier rejection.
#pragma once

#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct TrackingOptions {
  int max_features = 200;
  double min_distance = 16.0;
  int fast_threshold = 16;
  int border = 12;
  int keyframe_corners = 400;

  void visit(OptionVisitor& v) {
    v.field("max_features", max_features, 20, 2000, "features tracked per image");
    v.field("min_distance", min_distance, 3.0, 200.0,
            "smallest distance between tracked features, px of an image of 640 x 480");
    v.field("fast_threshold", fast_threshold, 2, 100,
            "FAST threshold, grey levels; where it finds nothing, what noise of grey values allows");
    v.field("border", border, 4, 100, "no features nearer to the image border, px of an image of 640 x 480");
    v.field("keyframe_corners", keyframe_corners, 0, 5000, "untracked ORB corners added to a keyframe");
  }
};

}  // namespace vip_slam
