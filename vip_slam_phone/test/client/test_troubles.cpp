// SPDX-License-Identifier: BSD-3-Clause
// What goes wrong with a phone is said in words, and nothing else is.
#include <algorithm>
#include <functional>

#include <gtest/gtest.h>

#include "vip_slam_phone/troubles.h"

namespace vip_slam::phone {
namespace {

/// Ten seconds of a phone that does all as it should.
struct Looks {
  PhoneStatus before, now;

  Looks() {
    for (StreamStatus* stream : {&before.records, &before.video, &before.depth}) {
      stream->connected = true;
      stream->connections = 1;
      stream->received = 100;
    }
    before.sender_report = before.clock_ready = true;
    now = before;
    now.imu = 1000;
    now.color = now.depth_images = 300;
  }
  std::vector<std::string> words() const { return troubles(before, now, 10); }
};

/// All words of the troubles, after `spoil`.
std::vector<std::string> after(const std::function<void(Looks*)>& spoil) {
  Looks looks;
  spoil(&looks);
  return looks.words();
}

Handshake handshake() {
  Handshake h;
  h.protocol = "irtsp-imu";
  h.version = kKnownVersion;
  h.revision = kKnownRevision;
  h.streams = {{"imu", true}, {"intrinsics", true}, {"pose", true}};
  return h;
}

/// Exactly one, which holds the text.
void expectOne(const std::vector<std::string>& words, const std::string& text) {
  ASSERT_EQ(words.size(), 1u) << text;
  EXPECT_NE(words[0].find(text), std::string::npos) << words[0];
}

TEST(PhoneTroubles, NoneOfAPhoneThatDoesAllAsItShould) {
  EXPECT_TRUE(Looks().words().empty());
  EXPECT_TRUE(complaints(handshake()).empty());
}

TEST(PhoneTroubles, WhatTheAppsSettingsSpoil) {
  const auto say = [](const Handshake& h) { return after([&](Looks* l) { l->now.complaints = complaints(h); }); };
  Handshake h = handshake();
  h.streams["imu"] = false;
  expectOne(say(h), "the IMU is switched off in the app");
  h = handshake();
  h.streams["intrinsics"] = false;
  expectOne(say(h), "intrinsics are switched off");
  h = handshake();
  h.streams["pose"] = false;
  expectOne(say(h), "does not run ARKit");
  h = handshake();
  h.revision = 7;
  expectOne(say(h), "the app's protocol is 2.7, known here are 2.0 to 2.6");
}

TEST(PhoneTroubles, AStreamThatIsSwitchedOffOrGone) {
  const std::string refused = "192.0.2.7:8556: Connection refused";
  auto words = after([&](Looks* l) { l->now.depth = {false, 0, 0, 0, refused}; });
  expectOne(words, "no depth (" + refused + "): switch on depth in the app");
  EXPECT_NE(words[0].find("visual-inertially"), std::string::npos);
  words = after([&](Looks* l) {
    l->now.records = {false, 0, 0, 0, refused};
    l->now.imu = 0;
  });
  expectOne(words, "no IMU (" + refused + "): switch on the IMU in the app");
  words = after([&](Looks* l) { l->now.video = {false, 2, 100, 0, "192.0.2.7:8554: closed by the phone"}; });
  expectOne(words, "no video (192.0.2.7:8554: closed by the phone): is the app streaming?");
}

TEST(PhoneTroubles, WhatAStreamComplainsOf) {
  expectOne(after([](Looks* l) { l->now.depth.problem = "depth by LZFSE"; }), "depth: depth by LZFSE");
}

TEST(PhoneTroubles, APhoneThatSleepsIsOneTroubleAndNotThree) {
  const auto words = after([](Looks* l) {
    for (StreamStatus* stream : {&l->now.records, &l->now.video, &l->now.depth})
      *stream = {false, 1, 100, 0, "192.0.2.7:8554: nothing for 3 s"};
    l->now.imu = 0;
    l->now.sender_report = false;
    l->now.complaints = {"of the time before"};
  });
  expectOne(words, "the phone does not answer (192.0.2.7:8554: nothing for 3 s): is its screen on");
  EXPECT_NE(words[0].find("the map stays"), std::string::npos);
}

TEST(PhoneTroubles, WhatWasLostBeforeAPhoneFellAsleepIsSaid) {
  const auto words = after([](Looks* l) {
    for (StreamStatus* stream : {&l->now.records, &l->now.video, &l->now.depth})
      *stream = {false, 1, 100, 0, "192.0.2.7:8554: nothing for 3 s"};
    l->now.video.lost = l->before.video.lost + 5;
  });
  ASSERT_EQ(words.size(), 2u);
  EXPECT_EQ(words[1].find("5 packets of the video were lost"), 0u) << words[1];
}

TEST(PhoneTroubles, UprightImages) {
  expectOne(after([](Looks* l) { l->now.assembly.portrait = 40; }), "images are upright");
  expectOne(after([](Looks* l) {
              l->before.assembly.portrait = 40;
              l->now.assembly.portrait = 80;
            }),
            "images are upright");
  EXPECT_TRUE(after([](Looks* l) { l->before.assembly.portrait = l->now.assembly.portrait = 40; }).empty());
}

TEST(PhoneTroubles, TooFewImuSamples) {
  EXPECT_TRUE(after([](Looks* l) { l->now.imu = 900; }).empty());
  expectOne(after([](Looks* l) { l->now.imu = 890; }), "89 IMU samples a second, expected about 100");
  // Not of a connection that is new, ...
  EXPECT_TRUE(after([](Looks* l) {
                l->now.records.connections = 2;
                l->now.imu = 500;
              }).empty());
  // ... nor while the clock is being found: none come out.
  EXPECT_TRUE(after([](Looks* l) {
                l->before.clock_ready = false;
                l->now.imu = 500;
              }).empty());
}

TEST(PhoneTroubles, NoSenderReportYet) {
  expectOne(after([](Looks* l) {
              l->now.sender_report = false;
              l->now.untimed = 27;
            }),
            "no RTCP sender report yet: the time of the images is not known, 27 were left out");
}

TEST(PhoneTroubles, LossesAreThoseSinceTheLastLook) {
  const auto lost = [](std::size_t was, std::size_t is) {
    return after([&](Looks* l) {
      l->before.video.lost = l->before.depth.lost = l->before.assembly.imu_lost = was;
      l->now.video.lost = l->now.depth.lost = l->now.assembly.imu_lost = is;
    });
  };
  EXPECT_TRUE(lost(12, 12).empty());
  const auto words = lost(12, 17);
  ASSERT_EQ(words.size(), 3u);
  EXPECT_EQ(words[0].find("5 packets of the video were lost"), 0u) << words[0];
  EXPECT_EQ(words[1].find("5 depth images were lost"), 0u) << words[1];
  EXPECT_EQ(words[2].find("5 records were lost"), 0u) << words[2];
}

TEST(PhoneTroubles, WhatWasNotPublishedInTime) {
  expectOne(after([](Looks* l) {
              l->before.left_out = {3, 10};
              l->now.left_out = {5, 10};
            }),
            "2 images and 0 samples were left out: publishing is too slow");
  EXPECT_TRUE(after([](Looks* l) { l->before.left_out = l->now.left_out = {3, 10}; }).empty());
}

TEST(PhoneTroubles, TheGravestComesFirst) {
  const auto words = after([](Looks* l) {
    l->now.video = {false, 2, 100, 0, "gone"};
    l->now.depth.lost = 3;
    l->now.complaints = complaints([] {
      Handshake h = handshake();
      h.streams["pose"] = false;
      return h;
    }());
  });
  ASSERT_EQ(words.size(), 3u);
  EXPECT_EQ(words[0].find("no video"), 0u);
  EXPECT_NE(words[1].find("ARKit"), std::string::npos);
  EXPECT_NE(words[2].find("depth images were lost"), std::string::npos);
}

}  // namespace
}  // namespace vip_slam::phone
