// SPDX-License-Identifier: BSD-3-Clause
// The client against servers that say wrong things: it names them, and goes on when they say right ones.
#include <chrono>

#include <gtest/gtest.h>

#include "fake_server.h"
#include "vip_slam_phone/net/tcp_stream.h"
#include "vip_slam_phone/phone_client.h"

namespace vip_slam::phone {
namespace {

Raw withLength(std::uint32_t length, const std::string& text) {
  Raw out(4);
  put(&out, 0, length);
  out.insert(out.end(), text.begin(), text.end());
  return out;
}
Raw withLength(const std::string& text) { return withLength(static_cast<std::uint32_t>(text.size()), text); }
Raw operator+(Raw a, const Raw& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

const std::string kRecords =
    R"({"protocol":"irtsp-imu","version":2,"revision":6,"record_bytes":64,"streams":{"imu":true,"intrinsics":true,"pose":true}})";
const std::string kDepth = R"({"protocol":"irtsp-depth","version":2})";

/// What the client says once a condition holds, or after ten seconds.
PhoneStatus statusWhen(const PhoneClient& client, const std::function<bool(const PhoneStatus&)>& holds) {
  for (int i = 0;; ++i) {
    const PhoneStatus status = client.status();
    if (i == 1000 || holds(status)) return status;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

PhoneOptions optionsFor(const FakeServer& video, const FakeServer& records, const FakeServer& depth) {
  PhoneOptions options;
  options.host = "127.0.0.1";
  options.rtsp_port = video.port();
  options.record_port = records.port();
  options.depth_port = depth.port();
  return options;
}

TEST(PhoneMessage, LengthsAreCheckedBeforeTheyAreBelieved) {
  std::mt19937 random(2);
  std::uint32_t length = 0;
  FakeServer server([&](int) { return withLength(length, std::string(100, 'x')); });
  const std::atomic<bool> stop{false};
  const auto read = [&](std::uint32_t prefix) -> std::string {
    length = prefix;
    TcpStream stream("127.0.0.1", server.port(), 5, stop);
    try {
      EXPECT_EQ(stream.readMessage(10, 1000, "handshake").size(), prefix);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(read(10), "");
  EXPECT_EQ(read(100), "");
  EXPECT_NE(read(101).find("closed by the phone"), std::string::npos);
  EXPECT_NE(read(9).find("handshake of 9 bytes, expected 10 to 1000"), std::string::npos);
  EXPECT_NE(read(1001).find("handshake of 1001 bytes"), std::string::npos);
  EXPECT_NE(read(0xffffffffu).find("handshake of 4294967295 bytes"), std::string::npos);
  for (int i = 0; i < 100; ++i) {
    const auto any = static_cast<std::uint32_t>(random() >> (random() % 32));
    EXPECT_EQ(read(any).empty(), any >= 10 && any <= 100) << any;
  }
}

TEST(PhoneClient, WrongLengthsAreNamedAndTheNextConnectionServes) {
  Raw records = withLength(kRecords);
  for (int i = 0; i < 5; ++i) records = records + record(1, static_cast<std::uint16_t>(i), 1 + i, 1e9 + i);
  FakeServer video([](int) { return Raw(); });
  FakeServer depth([](int k) { return withLength(kDepth) + withLength(k == 0 ? 0xffffffffu : 31, "?"); });
  FakeServer record_server([&](int k) { return k == 0 ? withLength(0x54545448, "HTTP") : records; });
  PhoneClient client(
      optionsFor(video, record_server, depth), [] { return 1.0; }, [](const Assembled&) {});
  PhoneStatus status = statusWhen(client, [](const PhoneStatus& s) {
    return s.depth.problem.find("4294967295") != std::string::npos && !s.records.problem.empty();
  });
  EXPECT_NE(status.depth.problem.find("depth image of 4294967295 bytes, expected 32 to 4194336"), std::string::npos)
      << status.depth.problem;
  EXPECT_NE(status.records.problem.find("handshake of 1414812744 bytes"), std::string::npos) << status.records.problem;
  EXPECT_EQ(status.records.connections, 0u);
  status = statusWhen(client, [](const PhoneStatus& s) {
    return s.records.received >= 5 && s.depth.problem.find("depth image of 31 bytes") != std::string::npos;
  });
  EXPECT_GE(status.records.received, 5u);
  EXPECT_TRUE(status.complaints.empty());
  EXPECT_GE(status.depth.connections, 2u);
  EXPECT_NE(status.depth.problem.find("depth image of 31 bytes"), std::string::npos) << status.depth.problem;
}

TEST(PhoneClient, AnotherServiceOnThePortIsNamed) {
  FakeServer video([](int) { return Raw{'H', 'T', 'T', 'P', '\r', '\n', '\r', '\n'}; });
  FakeServer records([](int) { return withLength(kDepth); });
  FakeServer depth([](int) { return withLength("[1, 2]"); });
  PhoneClient client(
      optionsFor(video, records, depth), [] { return 1.0; }, [](const Assembled&) {});
  const PhoneStatus status = statusWhen(client, [](const PhoneStatus& s) {
    return !s.video.problem.empty() && !s.records.problem.empty() && !s.depth.problem.empty();
  });
  EXPECT_NE(status.video.problem.find("no answer of RTSP"), std::string::npos) << status.video.problem;
  EXPECT_NE(status.records.problem.find("the port speaks 'irtsp-depth', expected 'irtsp-imu'"), std::string::npos)
      << status.records.problem;
  EXPECT_NE(status.depth.problem.find("no JSON object"), std::string::npos) << status.depth.problem;
}

TEST(PhoneClientFuzz, DamagedStreamsEndInWordsAndNotInACrash) {
  std::mt19937 random(6);
  std::mutex mutex;
  Raw records = withLength(kRecords), depth = withLength(kDepth);
  for (int i = 0; i < 20; ++i) records = records + record(i % 2 ? 5 : 1, static_cast<std::uint16_t>(i), i, 1e9 + i);
  depth = depth + withLength(std::string(200, '\0'));
  const auto spoilt = [&](const Raw& good) {
    const std::lock_guard<std::mutex> lock(mutex);
    return damaged(good, &random);
  };
  for (int i = 0; i < 60; ++i) {
    FakeServer video([&](int) { return spoilt({'R', 'T', 'S', 'P', '/', '1', '.', '0', '\r', '\n', '\r', '\n'}); });
    FakeServer record_server([&](int) { return spoilt(records); });
    FakeServer depth_server([&](int) { return spoilt(depth); });
    PhoneClient client(
        optionsFor(video, record_server, depth_server), [] { return 1.0; }, [](const Assembled&) {});
    const PhoneStatus status = statusWhen(client, [](const PhoneStatus& s) {
      return !s.video.problem.empty() && !s.records.problem.empty() && !s.depth.problem.empty();
    });
    EXPECT_FALSE(status.video.problem.empty());
    EXPECT_FALSE(status.records.problem.empty());
    EXPECT_FALSE(status.depth.problem.empty());
  }
}

TEST(PhoneClient, WhoTakesImagesSlowlyDoesNotStopTheReading) {
  // Thirty seconds of IMU at once; the taker holds on to the first of them.
  Raw records = withLength(kRecords);
  for (int i = 0; i < 3000; ++i) records = records + record(1, static_cast<std::uint16_t>(i), 0.01 * i, 1e9 + 0.01 * i);
  FakeServer nothing([](int) { return Raw(); }), record_server([&](int) { return records; });
  std::atomic<bool> held{true};
  std::atomic<int> ticks{0};
  {
    PhoneClient client(
        optionsFor(nothing, record_server, nothing), [&] { return 1000 + 0.01 * ticks++; },
        [&](const Assembled&) {
          while (held) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        });
    const PhoneStatus status = statusWhen(client, [](const PhoneStatus& s) { return s.records.received >= 3000; });
    EXPECT_GE(status.records.received, 3000u);
    // At most as many as wait, and as many that the taker holds.
    EXPECT_GT(status.imu, 2 * Outbox::kMaxSamples);
    EXPECT_GE(status.left_out.samples + 2 * Outbox::kMaxSamples, status.imu);
    held = false;
  }
}

}  // namespace
}  // namespace vip_slam::phone
