// SPDX-License-Identifier: BSD-3-Clause
// The video port of the stand-in: RTSP 1.0 with interleaved RTP.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "rtp_writer.h"
#include "server.h"

namespace vip_slam::phone {

class RtspServer {
 public:
  RtspServer(int port, Codec codec);
  /// A coded picture at `unix_time` s of the phone's clock, in writes of at most `piece` bytes (0: any); without its
  /// last packet when `lose_one`.
  void send(const std::vector<std::vector<std::uint8_t>>& units, double unix_time, std::size_t piece, bool lose_one);
  void disconnect() { port_->disconnect(); }

 private:
  bool greet(int client);
  bool answer(int client, const std::string& request);
  void listenOn(int client);
  Codec codec_;
  RtpWriter writer_;
  std::atomic<std::uint8_t> channel_{0};  ///< of the video, as the client wants it
  double first_ = -1, last_report_ = 0;
  std::unique_ptr<Port> port_;
};

}  // namespace vip_slam::phone
