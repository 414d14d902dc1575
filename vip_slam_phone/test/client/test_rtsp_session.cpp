// SPDX-License-Identifier: BSD-3-Clause
// What an RTSP server may say, rightly and wrongly.
#include <gtest/gtest.h>

#include "fake_server.h"
#include "vip_slam_phone/video/rtsp_session.h"

namespace vip_slam::phone {
namespace {

const std::string kSdp = "v=0\r\nm=video 0 RTP/AVP 96\r\na=rtpmap:96 H264/90000\r\na=control:trackID=0\r\n";

std::string answer(const std::string& fields, const std::string& body = "", const std::string& status = "200 OK") {
  return "RTSP/1.0 " + status + "\r\nCSeq: 1\r\n" + fields +
         (body.empty() ? "" : "Content-Length: " + std::to_string(body.size()) + "\r\n") + "\r\n" + body;
}
std::string packet(std::uint8_t channel, const std::string& data) {
  return {'$', static_cast<char>(channel), static_cast<char>(data.size() >> 8), static_cast<char>(data.size())};
}
std::string framed(std::uint8_t channel, const std::string& data) { return packet(channel, data) + data; }

const std::string kDescribed = answer("Content-Type: application/sdp\r\n", kSdp);
const std::string kSetUp = answer("Session: 7;timeout=60\r\nTransport: RTP/AVP/TCP;unicast;interleaved=2-3\r\n");
const std::string kPlays = answer("Session: 7\r\n");

Raw raw(const std::string& text) { return {text.begin(), text.end()}; }

/// Plays against what the server says until it ends; the packets that came, and the error that ended it.
struct Played {
  std::vector<RtspSession::Packet> packets;
  std::string error;
};
Played play(const std::string& said, const Credentials& credentials = {}) {
  FakeServer server([&](int) { return raw(said); });
  const std::atomic<bool> stop{false};
  Played out;
  try {
    TcpStream stream("127.0.0.1", server.port(), 5, stop);
    RtspSession session(&stream, "rtsp://127.0.0.1/live", credentials);
    for (;;) out.packets.push_back(session.next());
  } catch (const WireError& e) {
    out.error = e.what();
  } catch (const ConnectionError& e) {
    out.error = e.what();
  }
  return out;
}

#define EXPECT_SAYS(said, text) EXPECT_NE((said).error.find(text), std::string::npos) << (said).error

TEST(RtspSession, PacketsOfTheChosenChannelsAmongOthersAndAnswers) {
  const Played played =
      play(kDescribed + kSetUp + framed(2, "early") + kPlays + framed(2, "video") + framed(0, "sound") + answer("") +
           framed(3, "report") + framed(2, "") + framed(2, std::string(65535, 'x')));
  ASSERT_EQ(played.packets.size(), 4u) << played.error;
  EXPECT_EQ(played.packets[0].data, raw("video"));
  EXPECT_FALSE(played.packets[0].control);
  EXPECT_EQ(played.packets[1].data, raw("report"));
  EXPECT_TRUE(played.packets[1].control);
  EXPECT_TRUE(played.packets[2].data.empty());
  EXPECT_EQ(played.packets[3].data.size(), 65535u);
  EXPECT_SAYS(played, "closed by the phone");
}

TEST(RtspSession, WhatIsNoPacketEndsIt) {
  const std::string good = kDescribed + kSetUp + kPlays + framed(2, "video");
  EXPECT_SAYS(play(good + "hello"), "neither a packet nor an answer");
  EXPECT_SAYS(play(good + packet(2, "longer than what comes") + "short"), "closed by the phone");
  EXPECT_SAYS(play(good + "RTSP/1.0 200" + std::string(20000, ' ')), "answer without an end");
  EXPECT_EQ(play(good + "hello").packets.size(), 1u);
}

TEST(RtspSession, AnswersThatAreNone) {
  EXPECT_SAYS(play("HTTP/1.1 400 Bad Request\r\n\r\n"), "no answer of RTSP");
  EXPECT_SAYS(play("SSH-2.0-OpenSSH_9.2\r\n\r\n"), "is this port the app's?");
  EXPECT_SAYS(play(std::string(20000, 'x')), "answer without an end");
  EXPECT_SAYS(play(""), "closed by the phone");
  EXPECT_SAYS(play(answer("Content-Length: 99999999999\r\n")), "body of '99999999999' bytes");
  EXPECT_SAYS(play(answer("Content-Length: -1\r\n")), "body of '-1' bytes");
  EXPECT_SAYS(play(answer("Content-Length: many\r\n")), "body of 'many' bytes");
  EXPECT_SAYS(play(answer("")), "no video in it");
  EXPECT_SAYS(play(answer("", "", "404 Not Found")), "DESCRIBE was answered by 404 Not Found");
  EXPECT_SAYS(play(kDescribed + answer("Transport: RTP/AVP;unicast;client_port=5000-5001\r\n")), "over TCP");
  EXPECT_SAYS(play(kDescribed + answer("", "", "461 Unsupported Transport")), "SETUP was answered by 461");
}

TEST(RtspSession, Authentication) {
  const std::string asks = answer("WWW-Authenticate: Digest realm=\"a\", nonce=\"b\"\r\n", "", "401 Unauthorized");
  EXPECT_SAYS(play(asks), "asks for a user and password");
  EXPECT_SAYS(play(asks + asks, {"me", "secret"}), "refuses the user or the password");
  EXPECT_SAYS(play(answer("WWW-Authenticate: Bearer\r\n", "", "401 Unauthorized"), {"me", "secret"}),
              "neither Basic nor Digest");
  EXPECT_EQ(play(asks + kDescribed + kSetUp + kPlays + framed(2, "video"), {"me", "secret"}).packets.size(), 1u);
}

TEST(RtspSessionFuzz, DamagedConversationsEndInAnError) {
  const Raw good = raw(kDescribed + kSetUp + kPlays + framed(2, "video") + framed(3, "report") + answer(""));
  std::mt19937 random(11);
  std::map<std::string, int> errors;
  for (int i = 0; i < 400; ++i) {
    const Raw broken = damaged(good, &random);
    const Played played = play({broken.begin(), broken.end()});
    EXPECT_FALSE(played.error.empty());
    EXPECT_LE(played.packets.size(), 40u);
    ++errors[played.error.substr(0, 12)];
  }
  EXPECT_GT(errors.size(), 1u) << "nothing was damaged";
}

}  // namespace
}  // namespace vip_slam::phone
