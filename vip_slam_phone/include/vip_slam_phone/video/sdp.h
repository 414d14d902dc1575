// SPDX-License-Identifier: BSD-3-Clause
// The description of an RTSP session (SDP): where its video is and how it is coded.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_phone/video/depacketiser.h"

namespace vip_slam::phone {

struct VideoTrack {
  Codec codec = Codec::kH264;
  int payload_type = 96;
  std::string control;                       ///< address of the track, may be relative
  std::vector<std::uint8_t> parameter_sets;  ///< behind start codes; may be empty
};

/// Throws WireError: no video in it, another codec than H.264 and HEVC, another clock than 90 kHz.
VideoTrack videoOf(const std::string& sdp);

/// Throws WireError when it is not base64.
std::vector<std::uint8_t> decodeBase64(const std::string& text);

}  // namespace vip_slam::phone
