// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/stream_faults.h"

#include <cmath>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

std::string timeRanBack(double seconds) {
  return formatted("time ran back by %.3f s (a clock that was set or wraps round, or a bag that loops or was joined?)",
                   seconds);
}

std::string clockWasSet(const ClockStep& step, const std::string& topic) {
  const char* direction = step.seconds < 0 ? "back" : "forward";
  if (!step.stream)
    return formatted(
        "the clock was set %s by %.3f s at stamp %.3f s (NTP?): all streams stepped together, and time goes on from "
        "before",
        direction, std::abs(step.seconds), step.t);
  return formatted(
      "topic %s: its clock was set %s by %.3f s at stamp %.3f s, alone, as the arrival of its messages "
      "shows: later stamps are taken on its clock before",
      topic.c_str(), direction, std::abs(step.seconds), step.t);
}

std::string stampedAhead(std::size_t messages) {
  return formatted("%zu messages are left out: their stamps are ahead of those around them", messages);
}

std::string holdNoDepth(const DepthNoise& noise) {
  return formatted(
      "hold little or nothing within %g to %g m, the sensor file's range: wrong depth/scale or is_bigendian, emitter "
      "off, wrong topic?",
      noise.min_range, noise.max_range);
}

}  // namespace vip_slam
