// SPDX-License-Identifier: BSD-3-Clause
#include "parts/input_checks.h"

#include <cmath>

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/size_text.h"

namespace vip_slam::frontend {

std::string InputChecks::clockJump(double t, double newest, const char* what) const {
  if (!(t < newest - clock_jump_)) return "";
  return formatted("%s clock ran back by %.3f s", what, newest - t);
}

std::string InputChecks::problem(const FrameInput& input) {
  if (!std::isfinite(input.t)) {
    ++counters_->bad_stamp;
    return "image stamp is not finite";
  }
  if (input.t <= last_image_t_) {
    ++counters_->bad_stamp;
    return formatted("image stamp %.3f s does not follow %.3f s", input.t, last_image_t_);
  }
  if (input.gray.empty() || input.gray.type() != CV_8UC1) {
    ++counters_->bad_image;
    return input.gray.empty() ? "image is empty"
                              : "image is " + cv::typeToString(input.gray.type()) + ", expected 8-bit grey";
  }
  if (input.gray.size() != size_) {
    ++counters_->bad_image;
    return "image is " + sizeText(input.gray.size()) + ", the camera is " + sizeText(size_);
  }
  return "";
}

bool InputChecks::hasDepth(const FrameInput& input) {
  if (input.depth.empty()) {
    ++counters_->no_depth;
    return false;
  }
  const bool usable = input.depth.type() == CV_32FC1 && input.depth.size() == size_;
  counters_->bad_depth += !usable;
  return usable;
}

}  // namespace vip_slam::frontend
