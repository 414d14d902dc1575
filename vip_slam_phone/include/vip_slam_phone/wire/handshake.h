// SPDX-License-Identifier: BSD-3-Clause
// What the phone says of itself at the start of the record and depth streams.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace vip_slam::phone {

struct Handshake {
  std::string protocol;  ///< "irtsp-imu", "irtsp-depth"
  int version = 1, revision = 0;
  int record_bytes = 64;
  bool little_endian = true;
  std::map<std::string, bool> streams;  ///< which of them are on
  bool compression_zlib = false;        ///< depth: DEFLATE may be asked for

  bool streams_on(const std::string& name) const {
    const auto found = streams.find(name);
    return found != streams.end() && found->second;
  }
};

/// Longest handshake that is believed.
constexpr std::size_t kMaxHandshake = 1 << 16;
constexpr int kKnownVersion = 2, kKnownRevision = 6;

/// Throws WireError when the text is no JSON object or a field is of the wrong kind.
Handshake parseHandshake(const std::string& json);

/// What of it will not work here or was never tried, in words for the user; empty when all is well.
std::vector<std::string> complaints(const Handshake& handshake);

}  // namespace vip_slam::phone
