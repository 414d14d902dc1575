// Opening recordings, with the same error messages in every tool.
#pragma once

#include <string>

#include <rosbag/bag.h>

namespace vip_slam {

/// Opens `path` for reading. Throws std::runtime_error naming the file: missing, not a bag, or truncated, with the
/// remedy.
void openBag(const std::string& path, rosbag::Bag* bag);

}  // namespace vip_slam
