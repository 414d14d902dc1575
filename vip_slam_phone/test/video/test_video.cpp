// SPDX-License-Identifier: BSD-3-Clause
// RTP, the pictures in it, and the text of RTSP.
#include <algorithm>
#include <cctype>

#include <gtest/gtest.h>

#include "vip_slam_phone/video/depacketiser.h"
#include "vip_slam_phone/video/rtsp_text.h"
#include "vip_slam_phone/video/sdp.h"
#include "vip_slam_phone/video/video_decoder.h"
#include "wire_bytes.h"

namespace vip_slam::phone {
namespace {

Raw rtp(std::uint16_t sequence, std::uint32_t time, bool marker, const Raw& payload) {
  Raw bytes = {0x80,
               static_cast<std::uint8_t>(marker ? 0xe0 : 0x60),
               static_cast<std::uint8_t>(sequence >> 8),
               static_cast<std::uint8_t>(sequence),
               0,
               0,
               0,
               0,
               1,
               2,
               3,
               4};
  for (int i = 0; i < 4; ++i) bytes[4 + i] = static_cast<std::uint8_t>(time >> (24 - 8 * i));
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

/// Pictures of a parameter set, and a slice in three fragments; each four packets.
std::vector<Raw> stream(int pictures, std::uint16_t sequence, std::uint32_t time) {
  std::vector<Raw> out;
  for (int i = 0; i < pictures; ++i) {
    const std::uint8_t own = static_cast<std::uint8_t>(i);
    out.push_back(rtp(sequence++, time, false, {0x67, own}));
    out.push_back(rtp(sequence++, time, false, {0x7c, 0x85, own, 1}));
    out.push_back(rtp(sequence++, time, false, {0x7c, 0x05, own, 2}));
    out.push_back(rtp(sequence++, time, true, {0x7c, 0x45, own, 3}));
    time += 3000;
  }
  return out;
}

Raw picture(std::uint8_t own) { return {0, 0, 0, 1, 0x67, own, 0, 0, 0, 1, 0x65, own, 1, own, 2, own, 3}; }

std::vector<AccessUnit> feed(Depacketiser* depacketiser, const std::vector<Raw>& packets) {
  std::vector<AccessUnit> out;
  for (const Raw& packet : packets)
    for (AccessUnit& unit : depacketiser->add(parseRtp(packet))) out.push_back(unit);
  return out;
}

TEST(PhoneVideo, FragmentsBecomePicturesAcrossTheWrapOfSequenceAndTime) {
  Depacketiser depacketiser(Codec::kH264);
  const auto units = feed(&depacketiser, stream(20, 65500, 0xffffff00u));
  ASSERT_EQ(units.size(), 20u);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(units[i].data, picture(i));
    EXPECT_EQ(units[i].rtp_time, 0xffffff00u + 3000u * i);
    EXPECT_TRUE(units[i].key);
    EXPECT_FALSE(units[i].damaged);
  }
  EXPECT_EQ(depacketiser.lost(), 0u);
  const SenderReport report{100.0, 0xffffff00u};
  EXPECT_NEAR(report.timeOf(units[19].rtp_time), 100 + 19 / 30., 1e-9);
}

TEST(PhoneVideo, OutOfOrderIsPutRightAndLossMarksItsPicture) {
  auto packets = stream(20, 65530, 7);
  std::swap(packets[9], packets[10]);
  std::swap(packets[20], packets[23]);
  packets.erase(packets.begin() + 42);  // in picture 10
  Depacketiser depacketiser(Codec::kH264);
  const auto units = feed(&depacketiser, packets);
  ASSERT_GE(units.size(), 16u);
  EXPECT_EQ(depacketiser.lost(), 1u);
  for (std::size_t i = 0; i < units.size(); ++i) {
    EXPECT_EQ(units[i].damaged, i == 10) << i;
    if (i != 10) {
      EXPECT_EQ(units[i].data, picture(i));
    }
  }
}

TEST(PhoneVideo, AggregatesOfBothCodecs) {
  Depacketiser avc(Codec::kH264), hevc(Codec::kHevc);
  const auto a = feed(&avc, {rtp(1, 5, true, {0x78, 0, 2, 0x67, 9, 0, 1, 0x65})});
  ASSERT_EQ(a.size(), 1u);
  EXPECT_EQ(a[0].data, Raw({0, 0, 0, 1, 0x67, 9, 0, 0, 0, 1, 0x65}));
  const auto b = feed(&hevc, {rtp(1, 5, false, {0x60, 1, 0, 3, 0x40, 1, 7}), rtp(2, 5, false, {0x62, 1, 0x93, 4}),
                              rtp(3, 5, true, {0x62, 1, 0x53, 5})});
  ASSERT_EQ(b.size(), 1u);
  EXPECT_EQ(b[0].data, Raw({0, 0, 0, 1, 0x40, 1, 7, 0, 0, 0, 1, 0x26, 1, 4, 5}));
  EXPECT_TRUE(b[0].key);
}

TEST(PhoneVideo, SenderReportBehindAnotherPacket) {
  Raw bytes = {0x80, 201, 0, 1, 0, 0, 0, 0};
  const Raw report = {0x80, 200, 0, 6, 0, 0, 0, 1, 0x83, 0xaa, 0x7e, 0x81, 0x80, 0,
                      0,    0,   0, 0, 0, 9, 0, 0, 0,    0,    0,    0,    0,    0};
  bytes.insert(bytes.end(), report.begin(), report.end());
  const auto parsed = parseSenderReport(bytes);
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->unix_time, 1.5);  // 2208988801 s after 1900
  EXPECT_EQ(parsed->rtp_time, 9u);
}

const char* const kSdp =
    "v=0\r\nm=audio 0 RTP/AVP 97\r\na=rtpmap:97 MPEG4-GENERIC/48000\r\na=control:trackID=1\r\nm=video 0 RTP/AVP 96\r\n"
    "a=rtpmap:96 H264/90000\r\na=fmtp:96 packetization-mode=1; "
    "sprop-parameter-sets=Z0I=,aM4=\r\na=control:trackID=0\r\n";

TEST(PhoneVideo, TheVideoIsChosenFromTheDescription) {
  const VideoTrack track = videoOf(kSdp);
  EXPECT_EQ(track.control, "trackID=0");
  EXPECT_EQ(track.payload_type, 96);
  EXPECT_EQ(track.parameter_sets, Raw({0, 0, 0, 1, 0x67, 0x42, 0, 0, 0, 1, 0x68, 0xce}));
  EXPECT_THROW(videoOf("v=0\r\nm=audio 0 RTP/AVP 97\r\n"), WireError);
  EXPECT_THROW(videoOf("m=video 0 RTP/AVP 26\r\na=rtpmap:26 JPEG/90000\r\n"), WireError);
}

// The example of RFC 2617, 3.5, and without qop as cameras ask.
TEST(PhoneVideo, DigestAndBasic) {
  const auto asked = [](const std::string& challenge) {
    return parseAnswer("RTSP/1.0 401 Unauthorized\r\nWWW-Authenticate: " + challenge + "\r\n\r\n");
  };
  const Credentials mufasa{"Mufasa", "Circle Of Life"};
  const std::string digest =
      authorisation(asked("Digest realm=\"testrealm@host.com\", nonce=\"dcd98b7102dd2f0e8b11d0f600bfb0c093\""), mufasa,
                    "GET", "/dir/index.html");
  EXPECT_NE(digest.find("response=\"670fd8c2df070c60b045671b8b24ff02\""), std::string::npos) << digest;
  EXPECT_EQ(authorisation(asked("Basic realm=\"x\""), {"Aladdin", "open sesame"}, "GET", "/"),
            "Basic QWxhZGRpbjpvcGVuIHNlc2FtZQ==");
  EXPECT_THROW(authorisation(asked("Bearer"), mufasa, "GET", "/"), WireError);
}

TEST(PhoneVideoFuzz, WhateverIsAskedTheAnswerIsOneLine) {
  std::mt19937 random(8);
  int refused = 0;
  for (const std::string& challenge :
       {std::string("Digest realm=\"r\", nonce=\"n\", qop=\"auth\", opaque=\"o\""), std::string("Basic realm=\"r\""),
        std::string("Digest realm=\"open, nonce=,qop=auth"), std::string("Digest"), std::string("Digest realm=")}) {
    const std::string head = "RTSP/1.0 401 Unauthorized\r\nWWW-Authenticate: " + challenge + "\r\n\r\n";
    for (int i = 0; i < 4000; ++i) {
      const Raw broken = damaged(Raw(head.begin(), head.end()), &random);
      try {
        const std::string value =
            authorisation(parseAnswer({broken.begin(), broken.end()}), {"me", "secret"}, "SETUP", "rtsp://p/live");
        EXPECT_TRUE(value.rfind("Digest ", 0) == 0 || value.rfind("Basic ", 0) == 0);
        EXPECT_TRUE(std::none_of(value.begin(), value.end(), [](unsigned char c) { return std::iscntrl(c); }));
        EXPECT_EQ(value.find("secret"), std::string::npos);
      } catch (const WireError&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(PhoneVideoFuzz, DamagedPacketsAndTextsAreErrorsAtMost) {
  std::mt19937 random(5);
  const std::string sdp = kSdp, answer = "RTSP/1.0 200 OK\r\nCSeq: 1\r\nContent-Length: 12\r\n\r\n";
  for (const Codec codec : {Codec::kH264, Codec::kHevc}) {
    Depacketiser depacketiser(codec);
    VideoDecoder decoder(codec);
    const auto packets = stream(20, 65500, 0);
    for (int i = 0; i < 20000; ++i) {
      try {
        const Raw broken = damaged(packets[i % packets.size()], &random);
        for (const AccessUnit& unit : depacketiser.add(parseRtp(broken)))
          if (i < 4000) decoder.decode(unit.data, unit.rtp_time);
      } catch (const WireError&) {
      }
      try {
        parseSenderReport(
            damaged({0x80, 200, 0, 6, 0, 0, 0, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 9, 0, 0, 0, 0, 0}, &random));
      } catch (const WireError&) {
      }
      if (i % 10) continue;
      const Raw text = damaged(Raw(sdp.begin(), sdp.end()), &random);
      const Raw head = damaged(Raw(answer.begin(), answer.end()), &random);
      try {
        videoOf(std::string(text.begin(), text.end()));
      } catch (const WireError&) {
      }
      try {
        parseAnswer(std::string(head.begin(), head.end()));
      } catch (const WireError&) {
      }
    }
  }
}

}  // namespace
}  // namespace vip_slam::phone
