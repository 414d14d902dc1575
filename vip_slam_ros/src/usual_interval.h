// The usual interval between the messages of a stream, robust against losses and single wrong stamps.
#pragma once

#include <deque>
#include <vector>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam {

/// `intervals`: between messages in order, s; not empty.
inline double usualInterval(const std::deque<double>& intervals) {
  return upperMedian(std::vector<double>(intervals.begin(), intervals.end()));
}

}  // namespace vip_slam
