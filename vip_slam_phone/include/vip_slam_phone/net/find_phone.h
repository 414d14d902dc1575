// SPDX-License-Identifier: BSD-3-Clause
// Finds a phone in the local network by what it announces (Bonjour), with avahi's own command.
#pragma once

#include <string>

namespace vip_slam::phone {

/// Address of the first phone that announces its records. Throws std::runtime_error in words: avahi is not there, or
/// nobody announces.
std::string findPhone();

/// The address in the output of `avahi-browse -prt`; empty when there is none. IPv4 before IPv6.
std::string addressIn(const std::string& browse_output);

}  // namespace vip_slam::phone
