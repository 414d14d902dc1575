// SPDX-License-Identifier: BSD-3-Clause
// Options of the start.
#pragma once

#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct InitialisationOptions {
  double seconds = 0.15;
  int min_points = 8;

  void visit(OptionVisitor& v) {
    v.field("seconds", seconds, 0.05, 3.0, "usable images gathered for a start, s");
    v.field("min_points", min_points, 4, 1000, "points with depth that make an image usable; or flat surfaces do");
  }
};

}  // namespace vip_slam
