// SPDX-License-Identifier: BSD-3-Clause
// An RTSP 1.0 session (RFC 2326) with its video interleaved in the same TCP connection. Sound is left out.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "vip_slam_phone/net/tcp_stream.h"
#include "vip_slam_phone/video/rtsp_text.h"
#include "vip_slam_phone/video/sdp.h"

namespace vip_slam::phone {

class RtspSession {
 public:
  /// Asks, sets up and plays. Throws ConnectionError, or WireError with what the server refuses and what to do.
  RtspSession(TcpStream* stream, const std::string& url, const Credentials& credentials);

  const VideoTrack& track() const { return track_; }

  struct Packet {
    bool control = false;  ///< RTCP
    std::vector<std::uint8_t> data;
  };
  /// The next packet of the video. Keeps the session alive.
  Packet next();

 private:
  struct Reply {
    RtspAnswer answer;
    std::string body;
  };
  Reply ask(const std::string& method, const std::string& url, const std::string& fields = "");
  void send(const std::string& method, const std::string& url, const std::string& fields);
  Reply readReply(std::string head);
  std::string trackUrl(const RtspAnswer& described) const;

  TcpStream* stream_;
  std::string url_;
  Credentials credentials_;
  RtspAnswer challenge_;
  bool challenged_ = false;
  int sequence_ = 0;
  std::string session_;
  VideoTrack track_;
  std::uint8_t media_channel_ = 0, control_channel_ = 1;
  std::chrono::steady_clock::time_point alive_;
};

}  // namespace vip_slam::phone
