// SPDX-License-Identifier: BSD-3-Clause
// The parameter reference of the documentation, generated from the option structs.
#pragma once

#include <string>

namespace vip_slam {

/// The complete text of docs/parameters.md.
std::string parameterReference();

}  // namespace vip_slam
