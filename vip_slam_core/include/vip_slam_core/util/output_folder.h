// The folder that a tool writes its results into.
#pragma once

#include <string>

namespace vip_slam {

/// Makes `folder` when it does not exist, and tries that files can be written into it: a tool says so before hours of
/// work, not after. Throws std::runtime_error naming the folder and the reason.
void prepareOutputFolder(const std::string& folder);

}  // namespace vip_slam
