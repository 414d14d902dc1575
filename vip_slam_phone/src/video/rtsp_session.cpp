// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/video/rtsp_session.h"

namespace vip_slam::phone {

RtspSession::RtspSession(TcpStream* stream, const std::string& url, const Credentials& credentials)
    : stream_(stream), url_(url), credentials_(credentials), alive_(std::chrono::steady_clock::now()) {
  const Reply described = ask("DESCRIBE", url_, "Accept: application/sdp\r\n");
  track_ = videoOf(described.body);
  const std::string track = trackUrl(described.answer);
  const Reply set = ask("SETUP", track, "Transport: RTP/AVP/TCP;unicast;interleaved=0-1\r\n");
  session_ = set.answer.field("session");
  session_ = session_.substr(0, session_.find(';'));
  const std::string transport = set.answer.field("transport");
  if (const auto at = transport.find("interleaved="); at != std::string::npos) {
    unsigned media = 0, control = 1;
    if (std::sscanf(transport.c_str() + at, "interleaved=%u-%u", &media, &control) == 2 && media < 256 &&
        control < 256) {
      media_channel_ = static_cast<std::uint8_t>(media);
      control_channel_ = static_cast<std::uint8_t>(control);
    }
  } else {
    throw WireError("RTSP: the server does not send its video over TCP, which is all that is supported here");
  }
  const std::string base = described.answer.field("content-base");
  ask("PLAY", base.empty() ? url_ : base, "Range: npt=0.000-\r\n");
}

std::string RtspSession::trackUrl(const RtspAnswer& described) const {
  const std::string& control = track_.control;
  if (control.rfind("rtsp://", 0) == 0) return control;
  std::string base = described.field("content-base");
  if (base.empty()) base = url_;
  if (control.empty() || control == "*") return base;
  return base + (base.back() == '/' ? "" : "/") + control;
}

void RtspSession::send(const std::string& method, const std::string& url, const std::string& fields) {
  std::string text = method + " " + url + " RTSP/1.0\r\nCSeq: " + std::to_string(++sequence_) + "\r\n" + fields;
  if (!session_.empty()) text += "Session: " + session_ + "\r\n";
  if (challenged_) text += "Authorization: " + authorisation(challenge_, credentials_, method, url) + "\r\n";
  text += "User-Agent: vip_slam_phone\r\n\r\n";
  stream_->write(text.data(), text.size());
}

RtspSession::Reply RtspSession::ask(const std::string& method, const std::string& url, const std::string& fields) {
  for (int attempt = 0;; ++attempt) {
    send(method, url, fields);
    Reply reply;
    for (;;) {  // a packet of the video may come before the answer
      char first = 0;
      stream_->read(&first, 1);
      if (first != '$') {
        reply = readReply(std::string(1, first));
        break;
      }
      const auto head = stream_->read(3);
      stream_->read(Bytes(head).big<std::uint16_t>(1));
    }
    if (reply.answer.status == 200) return reply;
    if (reply.answer.status == 401) {
      if (credentials_.user.empty()) throw WireError("RTSP: the app asks for a user and password: give them");
      if (attempt > 0) throw WireError("RTSP: the app refuses the user or the password");
      challenge_ = reply.answer;
      challenged_ = true;
      continue;
    }
    throw WireError("RTSP: " + method + " was answered by " + std::to_string(reply.answer.status) + " " +
                    reply.answer.reason.substr(0, 60));
  }
}

RtspSession::Reply RtspSession::readReply(std::string head) {
  constexpr std::size_t kMaxHead = 16384, kMaxBody = 65536;
  while (head.size() < 4 || head.compare(head.size() - 4, 4, "\r\n\r\n") != 0) {
    if (head.size() > kMaxHead) throw WireError("RTSP: answer without an end; is this port the app's?");
    char c = 0;
    stream_->read(&c, 1);
    head += c;
  }
  Reply reply{parseAnswer(head), ""};
  const std::string length = reply.answer.field("content-length");
  if (length.empty()) return reply;
  char* end = nullptr;
  const unsigned long size = std::strtoul(length.c_str(), &end, 10);
  if (end == length.c_str() || size > kMaxBody) throw WireError("RTSP: body of '" + length.substr(0, 20) + "' bytes");
  reply.body.resize(size);
  stream_->read(reply.body.data(), size);
  return reply;
}

RtspSession::Packet RtspSession::next() {
  for (;;) {
    const auto now = std::chrono::steady_clock::now();
    if (now - alive_ > std::chrono::seconds(20)) {
      alive_ = now;
      send("OPTIONS", url_, "");
    }
    char first = 0;
    stream_->read(&first, 1);
    if (first == 'R') {  // the answer to what keeps it alive
      readReply("R");
      continue;
    }
    if (first != '$') throw WireError("RTSP: neither a packet nor an answer");
    const auto head = stream_->read(3);
    Packet packet;
    packet.data = stream_->read(Bytes(head).big<std::uint16_t>(1));
    packet.control = head[0] == control_channel_;
    if (packet.control || head[0] == media_channel_) return packet;
  }
}

}  // namespace vip_slam::phone
