// SPDX-License-Identifier: BSD-3-Clause
// Options of keyframe selection.
#pragma once

#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct KeyframeOptions {
  double min_parallax_px = 25.0;
  double min_tracked_ratio = 0.6;
  double max_seconds = 1.5;
  double min_seconds = 0.15;
  double max_rotation_deg = 15.0;
  double max_translation_ratio = 0.12;

  void visit(OptionVisitor& v) {
    v.field("min_parallax_px", min_parallax_px, 1.0, 500.0, "mean image motion without rotation for a keyframe, px");
    v.field("min_tracked_ratio", min_tracked_ratio, 0.05, 1.0,
            "a keyframe when fewer of the last one's features are left");
    v.field("max_seconds", max_seconds, 0.1, 60.0, "a keyframe at least this often while moving, s");
    v.field("min_seconds", min_seconds, 0.0, 10.0, "never two keyframes within this time, s");
    v.field("max_rotation_deg", max_rotation_deg, 1.0, 180.0, "a keyframe after this rotation, deg");
    v.field("max_translation_ratio", max_translation_ratio, 0.01, 2.0,
            "a keyframe after this translation over the median scene depth");
  }
};

}  // namespace vip_slam
