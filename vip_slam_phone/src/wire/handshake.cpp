// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/wire/handshake.h"

#include <yaml-cpp/yaml.h>

#include "vip_slam_phone/wire/bytes.h"

namespace vip_slam::phone {

// JSON is YAML; yaml-cpp bounds the depth of nesting.
Handshake parseHandshake(const std::string& json) {
  if (json.size() > kMaxHandshake) throw WireError("handshake of " + std::to_string(json.size()) + " bytes");
  Handshake out;
  try {
    const YAML::Node root = YAML::Load(json);
    if (!root.IsMap()) throw WireError("handshake is no JSON object: is this port the app's?");
    out.protocol = root["protocol"].as<std::string>("");
    const auto number = [&](const char* key, int absent) { return root[key] ? root[key].as<int>() : absent; };
    out.version = number("version", 1);
    out.revision = number("revision", 0);
    out.record_bytes = number("record_bytes", 64);
    out.little_endian = root["endianness"].as<std::string>("little") == "little";
    if (const YAML::Node streams = root["streams"]; streams && streams.IsMap())
      for (const auto& stream : streams)
        if (stream.first.IsScalar()) out.streams[stream.first.Scalar()] = stream.second.as<bool>(false);
    if (const YAML::Node compression = root["compression"]; compression && compression.IsMap())
      if (const YAML::Node supported = compression["supported"]; supported && supported.IsSequence())
        for (const YAML::Node& codec : supported) out.compression_zlib |= codec.as<std::string>("") == "zlib";
  } catch (const YAML::Exception& e) {
    throw WireError(std::string("handshake is no JSON as expected: ") + e.what());
  }
  return out;
}

std::vector<std::string> complaints(const Handshake& handshake) {
  std::vector<std::string> words;
  if (handshake.protocol == "irtsp-imu") {
    if (handshake.record_bytes != 64)
      throw WireError("the app sends records of " + std::to_string(handshake.record_bytes) + " bytes, expected 64");
    if (!handshake.little_endian) throw WireError("the app sends big-endian records, expected little-endian ones");
  }
  if (handshake.version != kKnownVersion || handshake.revision > kKnownRevision)
    words.push_back("the app's protocol is " + std::to_string(handshake.version) + "." +
                    std::to_string(handshake.revision) + ", known here are 2.0 to 2.6: some of it may be misread");
  if (handshake.protocol == "irtsp-imu" && !handshake.streams.empty()) {
    if (!handshake.streams_on("imu") && !handshake.streams_on("gyro"))
      words.push_back("the IMU is switched off in the app: switch it on there");
    if (!handshake.streams_on("intrinsics"))
      words.push_back("the camera's intrinsics are switched off in the app: switch them on there");
    if (!handshake.streams_on("pose"))
      words.push_back(
          "the app does not run ARKit: switch on its pose there, else images are turned upright and depth is not "
          "aligned with them");
  }
  return words;
}

}  // namespace vip_slam::phone
