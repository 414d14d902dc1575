// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/one_frame.h"

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_ros/tf_lookup.h"

namespace vip_slam {

bool OneFrame::admits(const std::string& frame_id) {
  const std::string frame = bareFrame(frame_id);
  if (admitted_ == 0) first_ = frame;
  if (frame == first_) {
    ++admitted_;
    return true;
  }
  other_ = frame;
  ++left_out_;
  return false;
}

std::string OneFrame::words() const {
  if (left_out_ == 0) return "";
  return formatted(
      "%zu of %zu messages have frame_id '%s' instead of '%s' as the first one, and are left out: two "
      "drivers under one name? give each a namespace of its own",
      left_out_, left_out_ + admitted_, other_.c_str(), first_.c_str());
}

}  // namespace vip_slam
