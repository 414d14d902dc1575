// SPDX-License-Identifier: BSD-3-Clause
// What a colour image and its stamp must be, and what of them is counted.
#pragma once

#include <string>

#include <opencv2/core.hpp>

#include "vip_slam_frontend/front_end.h"

namespace vip_slam::frontend {

class InputChecks {
 public:
  /// Stamps more than `clock_jump` s back mean another clock. `counters`: its rows of bad input are counted.
  InputChecks(cv::Size size, double clock_jump, FrontEndCounters* counters)
      : size_(size), clock_jump_(clock_jump), counters_(counters) {}

  /// Says by how much the clock of `what` ran back with a stamp t after the stamp `newest`; empty: it did not.
  std::string clockJump(double t, double newest, const char* what) const;
  std::string clockJump(const FrameInput& input) const { return clockJump(input.t, last_image_t_, "image"); }
  /// Empty when the image is usable, else what is wrong.
  std::string problem(const FrameInput& input);
  /// Whether it brings depth of the right kind.
  bool hasDepth(const FrameInput& input);
  /// The image is used: stamps have to follow its own, s.
  void accept(double t) { last_image_t_ = t; }
  /// The clock has jumped back.
  void reset() { last_image_t_ = -1e300; }

 private:
  cv::Size size_;
  double clock_jump_;
  FrontEndCounters* counters_;
  double last_image_t_ = -1e300;  ///< image clock
};

}  // namespace vip_slam::frontend
