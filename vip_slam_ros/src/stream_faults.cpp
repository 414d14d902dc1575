#include "vip_slam_ros/stream_faults.h"

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

std::string timeRanBack(double seconds) {
  return formatted("time ran backwards by %.1f s (a bag that loops?)", seconds);
}

std::string holdNoDepth(const DepthNoise& noise) {
  return formatted(
      "hold nothing within %g to %g m, the sensor file's range: wrong depth/scale, emitter off, wrong topic?",
      noise.min_range, noise.max_range);
}

}  // namespace vip_slam
