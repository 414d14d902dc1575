#include "rtsp_server.h"

#include <sys/socket.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>

namespace vip_slam::phone {
namespace {

constexpr std::uint32_t kFirstRtp = 0xfff00000u;  // wraps after 11 s
constexpr std::size_t kPacket = 1400;

void big(std::vector<std::uint8_t>* out, std::uint32_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) out->push_back(static_cast<std::uint8_t>(value >> shift));
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

RtspServer::RtspServer(int port)
    : port_(std::make_unique<Port>(
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
        "a=rtpmap:96 H264/90000\r\na=fmtp:96 packetization-mode=1\r\na=control:trackID=0\r\n";
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

void RtspServer::report(double unix_time, std::uint32_t rtp) {
  std::vector<std::uint8_t> out = {'$', static_cast<std::uint8_t>(channel_ + 1), 0, 28, 0x80, 200, 0, 6, 1, 2, 3, 4};
  const double ntp = unix_time + 2208988800.0;
  big(&out, static_cast<std::uint32_t>(ntp), 4);
  big(&out, static_cast<std::uint32_t>((ntp - std::floor(ntp)) * 4294967296.0), 4);
  big(&out, rtp, 4);
  big(&out, 0, 4);
  big(&out, 0, 4);
  port_->send(out);
  last_report_ = unix_time;
}

void RtspServer::send(const std::vector<std::vector<std::uint8_t>>& units, double unix_time, std::size_t piece,
                      bool lose_one) {
  if (first_ < 0) first_ = unix_time;
  const auto rtp = kFirstRtp + static_cast<std::uint32_t>(std::llround((unix_time - first_) * 90000));
  if (port_->fresh() || unix_time - last_report_ > 1) report(unix_time, rtp);
  const auto packet = [&](std::vector<std::uint8_t> payload, bool last) {
    const std::uint16_t sequence = sequence_++;
    if (lose_one && last) return;
    std::vector<std::uint8_t> out = {'$', channel_};
    big(&out, static_cast<std::uint32_t>(12 + payload.size()), 2);
    out.push_back(0x80);
    out.push_back(last ? 0xe0 : 0x60);
    big(&out, sequence, 2);
    big(&out, rtp, 4);
    big(&out, 0x01020304, 4);
    out.insert(out.end(), payload.begin(), payload.end());
    port_->send(out, piece);
  };
  for (std::size_t k = 0; k < units.size(); ++k) {
    const auto& unit = units[k];
    const bool last = k + 1 == units.size();
    if (unit.size() <= kPacket) {
      packet(unit, last);
      continue;
    }
    for (std::size_t at = 1; at < unit.size(); at += kPacket) {
      const std::size_t end = std::min(at + kPacket, unit.size());
      std::vector<std::uint8_t> payload = {
          static_cast<std::uint8_t>((unit[0] & 0xe0) | 28),
          static_cast<std::uint8_t>((at == 1 ? 0x80 : 0) | (end == unit.size() ? 0x40 : 0) | (unit[0] & 0x1f))};
      payload.insert(payload.end(), unit.begin() + at, unit.begin() + end);
      packet(std::move(payload), last && end == unit.size());
    }
  }
}

}  // namespace vip_slam::phone
