// SPDX-License-Identifier: BSD-3-Clause
// The folder that a tool writes its results into.
#pragma once

#include <string>

namespace vip_slam {

/// Creates `folder` when it does not exist, and checks that files can be written into it, so that a tool fails before
/// hours of work and not after. Throws std::runtime_error naming the folder and the reason.
void prepareOutputFolder(const std::string& folder);

}  // namespace vip_slam
