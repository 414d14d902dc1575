// Opening recordings: every tool says in the same words what is wrong with a bag.
#pragma once

#include <string>

#include <rosbag/bag.h>

namespace vip_slam {

/// Opens `path` for reading. Throws std::runtime_error naming the file: not there, no bag, or cut off, with what mends
/// it.
void openBag(const std::string& path, rosbag::Bag* bag);

}  // namespace vip_slam
