// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/video/sdp.h"

#include <sstream>

namespace vip_slam::phone {

std::vector<std::uint8_t> decodeBase64(const std::string& text) {
  static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> out;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const auto digit = kDigits.find(c);
    if (digit == std::string::npos) throw WireError("no base64: '" + text.substr(0, 40) + "'");
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    if ((count += 6) >= 8) out.push_back(static_cast<std::uint8_t>(bits >> (count -= 8)));
  }
  return out;
}

VideoTrack videoOf(const std::string& sdp) {
  VideoTrack track;
  bool inside = false, found = false, mapped = false;
  std::istringstream lines(sdp);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.rfind("m=", 0) == 0) {
      inside = !found && line.rfind("m=video", 0) == 0;
      found |= inside;
      continue;
    }
    if (!inside) continue;
    if (line.rfind("a=control:", 0) == 0) track.control = line.substr(10);
    if (line.rfind("a=rtpmap:", 0) == 0) {
      std::istringstream words(line.substr(9));
      std::string coding;
      if (!(words >> track.payload_type >> coding)) throw WireError("SDP: cannot read '" + line.substr(0, 80) + "'");
      const std::string name = coding.substr(0, coding.find('/'));
      if (name == "H264")
        track.codec = Codec::kH264;
      else if (name == "H265" || name == "HEVC")
        track.codec = Codec::kHevc;
      else
        throw WireError("SDP: video coded as '" + name.substr(0, 40) + "', expected H264 or H265");
      if (coding.substr(name.size()) != "/90000")
        throw WireError("SDP: '" + coding.substr(0, 40) + "', expected 90000 Hz");
      mapped = true;
    }
    if (line.rfind("a=fmtp:", 0) == 0) {
      std::istringstream words(line.substr(7));
      std::string skipped;
      words >> skipped;
      for (std::string field; std::getline(words, field, ';');) {
        field.erase(0, field.find_first_not_of(' '));
        const auto equals = field.find('=');
        const std::string key = field.substr(0, equals);
        if (equals == std::string::npos || (key != "sprop-parameter-sets" && key.rfind("sprop-", 0) != 0)) continue;
        std::istringstream sets(field.substr(equals + 1));
        for (std::string set; std::getline(sets, set, ',');) {
          if (key != "sprop-parameter-sets" && key != "sprop-vps" && key != "sprop-sps" && key != "sprop-pps") continue;
          const auto bytes = decodeBase64(set);
          track.parameter_sets.insert(track.parameter_sets.end(), {0, 0, 0, 1});
          track.parameter_sets.insert(track.parameter_sets.end(), bytes.begin(), bytes.end());
        }
      }
    }
  }
  if (!found || !mapped) throw WireError("SDP: no video in it");
  return track;
}

}  // namespace vip_slam::phone
