#include "vip_slam_ros/stream_faults.h"

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

std::string timeRanBack(double seconds) {
  return formatted("time ran backwards by %.1f s (a bag that loops?)", seconds);
}

std::string clockSetBack(double seconds, double t) {
  return formatted(
      "the clock was set back by %.2f s at %.3f s (NTP?): all streams stepped together; what repeats stamps is left "
      "out",
      seconds, t);
}

std::string holdNoDepth(const DepthNoise& noise) {
  return formatted(
      "hold little or nothing within %g to %g m, the sensor file's range: wrong depth/scale or is_bigendian, emitter "
      "off, wrong topic?",
      noise.min_range, noise.max_range);
}

}  // namespace vip_slam
