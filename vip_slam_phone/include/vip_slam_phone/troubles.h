// SPDX-License-Identifier: BSD-3-Clause
// What goes wrong with a phone, in words.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_phone/phone_client.h"

namespace vip_slam::phone {

/// What happened between two looks at a phone that is to be told to the user, the gravest first; empty: all is well.
std::vector<std::string> troubles(const PhoneStatus& before, const PhoneStatus& now, double seconds);

}  // namespace vip_slam::phone
