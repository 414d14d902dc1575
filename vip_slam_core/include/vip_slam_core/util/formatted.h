// SPDX-License-Identifier: BSD-3-Clause
// printf into a string.
#pragma once

#include <string>

namespace vip_slam {

/// What printf would print, of any length.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

}  // namespace vip_slam
