// SPDX-License-Identifier: BSD-3-Clause
#include "rtsp_server.h"

#include <sys/socket.h>
#include <cerrno>
#include <cmath>
#include <cstdlib>

namespace vip_slam::phone {
namespace {

constexpr std::uint32_t kFirstRtp = 0xfff00000u;  // wraps after 11 s

/// A packet as it is interleaved with the answers (RFC 2326, 10.12).
std::vector<std::uint8_t> interleaved(std::uint8_t channel, const std::vector<std::uint8_t>& packet) {
  std::vector<std::uint8_t> out = {'$', channel, static_cast<std::uint8_t>(packet.size() >> 8),
                                   static_cast<std::uint8_t>(packet.size())};
  out.insert(out.end(), packet.begin(), packet.end());
  return out;
}

/// A whole request's head; empty at the end of the connection. A second without one is none: "\n" is returned.
std::string readRequest(int client) {
  std::string text;
  while (text.size() < 4096 && (text.size() < 4 || text.compare(text.size() - 4, 4, "\r\n\r\n") != 0)) {
    char c;
    const ssize_t got = recv(client, &c, 1, 0);
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return "\n";
    if (got <= 0) return "";
    if (text.empty() && c == '$') {  // a receiver report: its length, and away
      std::uint8_t head[3];
      if (recv(client, head, 3, MSG_WAITALL) != 3) return "";
      std::vector<std::uint8_t> rest(head[1] << 8 | head[2]);
      if (recv(client, rest.data(), rest.size(), MSG_WAITALL) != static_cast<ssize_t>(rest.size())) return "";
      continue;
    }
    text += c;
  }
  return text;
}

}  // namespace

RtspServer::RtspServer(int port, Codec codec)
    : codec_(codec),
      writer_(codec),
      port_(std::make_unique<Port>(
          port, [this](int client) { return greet(client); }, [this](int client) { listenOn(client); })) {}

bool RtspServer::greet(int client) {
  for (;;) {
    const std::string request = readRequest(client);
    if (request.empty() || request == "\n" || !answer(client, request)) return false;
    if (request.rfind("PLAY", 0) == 0) return true;
  }
}

void RtspServer::listenOn(int client) {
  for (;;) {
    const std::string request = readRequest(client);
    if (request.empty() || request.rfind("TEARDOWN", 0) == 0) return;
    // Through the port, so that no packet of the video is cut in two.
    const auto at = request.find("CSeq: ");
    if (at == std::string::npos) continue;
    const std::string text = "RTSP/1.0 200 OK\r\n" + request.substr(at, request.find('\r', at) - at) + "\r\n\r\n";
    port_->send({text.begin(), text.end()});
  }
}

bool RtspServer::answer(int client, const std::string& request) {
  const auto at = request.find("CSeq: ");
  if (at == std::string::npos) return false;
  std::string text = "RTSP/1.0 200 OK\r\n" + request.substr(at, request.find('\r', at) - at) + "\r\nSession: 4711\r\n";
  std::string body;
  if (request.rfind("OPTIONS", 0) == 0) text += "Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN\r\n";
  if (request.rfind("DESCRIBE", 0) == 0) {
    body =
        "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=stand-in\r\nt=0 0\r\nm=audio 0 RTP/AVP 97\r\n"
        "a=rtpmap:97 MPEG4-GENERIC/48000/1\r\na=control:trackID=1\r\nm=video 0 RTP/AVP 96\r\n"
        "a=rtpmap:96 ";
    body += codec_ == Codec::kH264 ? "H264/90000\r\na=fmtp:96 packetization-mode=1\r\n" : "H265/90000\r\n";
    body += "a=control:trackID=0\r\n";
    text += "Content-Type: application/sdp\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
  }
  if (request.rfind("SETUP", 0) == 0) {
    if (request.find("RTP/AVP/TCP") == std::string::npos) {
      text.replace(0, 15, "RTSP/1.0 461 Unsupported Transport");
    } else {
      const auto channels = request.find("interleaved=");
      if (channels == std::string::npos) return false;
      const std::string named = request.substr(channels, request.find_first_of(";\r", channels) - channels);
      text += "Transport: RTP/AVP/TCP;unicast;" + named + "\r\n";
      // A player takes the sound as well, of which there is none.
      if (request.find("trackID=0") != std::string::npos)
        channel_ = static_cast<std::uint8_t>(std::atoi(request.c_str() + channels + 12));
    }
  }
  text += "\r\n" + body;
  return sendAll(client, text.data(), text.size());
}

void RtspServer::send(const std::vector<std::vector<std::uint8_t>>& units, double unix_time, std::size_t piece,
                      bool lose_one) {
  if (first_ < 0) first_ = unix_time;
  const auto rtp = kFirstRtp + static_cast<std::uint32_t>(std::llround((unix_time - first_) * 90000));
  if (port_->fresh() || unix_time - last_report_ > 1) {
    port_->send(interleaved(static_cast<std::uint8_t>(channel_ + 1), RtpWriter::report(unix_time, rtp)));
    last_report_ = unix_time;
  }
  std::vector<std::vector<std::uint8_t>> packets = writer_.packets(units, rtp);
  if (lose_one && !packets.empty()) packets.pop_back();
  for (const auto& packet : packets) port_->send(interleaved(channel_, packet), piece);
}

}  // namespace vip_slam::phone
