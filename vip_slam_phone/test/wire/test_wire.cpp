// SPDX-License-Identifier: BSD-3-Clause
// Records, handshakes and depth images: their meaning, and that damage is an error and no crash.
#include <cmath>
#include <limits>

#include <zlib.h>

#include <gtest/gtest.h>

#include "vip_slam_phone/wire/depth_frame.h"
#include "vip_slam_phone/wire/handshake.h"
#include "vip_slam_phone/wire/record.h"
#include "wire_bytes.h"

namespace vip_slam::phone {
namespace {

template <typename F>
std::string errorOf(F f) {
  try {
    f();
  } catch (const WireError& e) {
    return e.what();
  }
  return "";
}

TEST(PhoneRecord, ImuAtRestFaceUpHasGravityUpwards) {
  Raw bytes = record(1, 65535, 12.5, 1.7e9);
  put(&bytes, 24, 0.25f);
  put(&bytes, 44, -1.0f);  // g, the app's sign
  const Record parsed = parseRecord(bytes);
  EXPECT_EQ(parsed.sequence, 65535);
  EXPECT_EQ(parsed.host_time, 12.5);
  const auto& imu = std::get<ImuRecord>(parsed.what);
  EXPECT_EQ(imu.gyro->x(), 0.25);
  EXPECT_NEAR(imu.accel->z(), 9.80665, 1e-6);
}

TEST(PhoneRecord, IntrinsicsWithExposureOfEitherType) {
  for (const bool integer : {true, false}) {
    Raw bytes = record(5, 1, 2, 3);
    const float k[6] = {1400, 1401, 960, 720, 1920, 1440};
    std::memcpy(bytes.data() + 24, k, sizeof(k));
    if (integer)
      put(&bytes, 60, std::uint32_t(8333));
    else
      put(&bytes, 60, 8333.f);
    const auto camera = std::get<IntrinsicsRecord>(parseRecord(bytes).what);
    EXPECT_EQ(camera.camera.fy, 1401);
    EXPECT_EQ(camera.camera.height, 1440);
    EXPECT_NEAR(camera.exposure, 0.008333, 1e-9);
    put(&bytes, 24, std::numeric_limits<float>::quiet_NaN());
    EXPECT_NE(errorOf([&] { parseRecord(bytes); }).find("fx"), std::string::npos);
  }
}

TEST(PhoneRecord, PoseLooksAlongTheOpticalAxis) {
  Raw bytes = record(9, 1, 2, 3);
  put(&bytes, 36, 2.f);
  put(&bytes, 60, 1.f);  // w: ARKit's camera looks along -z, y up
  const auto pose = std::get<PoseRecord>(parseRecord(bytes).what);
  EXPECT_EQ(pose.tracking, 2);
  EXPECT_NEAR((pose.T_world_cam.R() * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(), 0, 1e-12);
  EXPECT_NEAR((pose.T_world_cam.R() * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitY()).norm(), 0, 1e-12);
}

Raw depthMessage(int width, int height, bool half, int codec) {
  Raw samples(std::size_t(width) * height * (half ? 2 : 4), 0);
  for (int i = 0; i < width * height; ++i)
    half ? put(&samples, 2 * i, std::uint16_t(i % 2 ? 0x3e00 : 0x7e00))  // 1.5 m and no number
         : put(&samples, 4 * i, i % 2 ? 1.5f : -1.f);
  if (codec == 2) {
    Raw packed(samples.size() + 100);
    z_stream z{};
    deflateInit2(&z, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    z.next_in = samples.data();
    z.avail_in = samples.size();
    z.next_out = packed.data();
    z.avail_out = packed.size();
    deflate(&z, Z_FINISH);
    packed.resize(z.total_out);
    deflateEnd(&z);
    samples = packed;
  }
  Raw bytes(32, 0);
  bytes[0] = 10;
  bytes[1] = (half ? 1 : 0) | (codec ? 2 : 0);
  put(&bytes, 16, 5.0);
  put(&bytes, 24, std::uint16_t(width));
  put(&bytes, 26, std::uint16_t(height));
  bytes[28] = half ? 2 : 4;
  bytes[29] = codec;
  bytes.insert(bytes.end(), samples.begin(), samples.end());
  return bytes;
}

TEST(PhoneDepth, HalvesFloatsAndDeflateToMetres) {
  for (const bool half : {true, false})
    for (const int codec : {0, 2}) {
      const DepthFrame frame = parseDepthFrame(depthMessage(64, 48, half, codec));
      ASSERT_EQ(frame.metres.size(), cv::Size(64, 48));
      EXPECT_EQ(frame.metres.at<float>(3, 5), 1.5f);
      EXPECT_EQ(frame.metres.at<float>(3, 4), 0.f);
      EXPECT_EQ(frame.unix_time, 5.0);
    }
}

TEST(PhoneDepth, WhatIsNotSupportedIsNamed) {
  Raw bytes = depthMessage(64, 48, true, 2);
  bytes[29] = 1;
  EXPECT_NE(errorOf([&] { parseDepthFrame(bytes); }).find("LZFSE"), std::string::npos);
  bytes = depthMessage(64, 48, true, 0);
  bytes.pop_back();
  EXPECT_NE(errorOf([&] { parseDepthFrame(bytes); }).find("6143 bytes for 64x48"), std::string::npos);
  put(&bytes, 24, std::uint16_t(65535));
  EXPECT_NE(errorOf([&] { parseDepthFrame(bytes); }).find("65535x48"), std::string::npos);
}

const char* const kHandshake = R"({"protocol":"irtsp-imu","version":2,"revision":6,"endianness":"little",
  "record_bytes":64,"streams":{"imu":true,"intrinsics":true,"pose":true,"gnss":false}})";

TEST(PhoneHandshake, SaysWhatIsSwitchedOff) {
  EXPECT_TRUE(complaints(parseHandshake(kHandshake)).empty());
  std::string text = kHandshake;
  text.replace(text.find("\"imu\":true"), 10, "\"imu\":false");
  ASSERT_EQ(complaints(parseHandshake(text)).size(), 1u);
  EXPECT_NE(complaints(parseHandshake(text))[0].find("IMU is switched off"), std::string::npos);
  text.replace(text.find("\"revision\":6"), 12, "\"revision\":9");
  EXPECT_NE(complaints(parseHandshake(text))[0].find("2.9"), std::string::npos);
  text.replace(text.find("\"record_bytes\":64"), 17, "\"record_bytes\":80");
  EXPECT_NE(errorOf([&] { complaints(parseHandshake(text)); }).find("80 bytes"), std::string::npos);
}

TEST(PhoneFuzz, DamagedMessagesAreErrorsAtMost) {
  std::mt19937 random(1);
  const std::string text = kHandshake;
  int refused = 0;
  for (int i = 0; i < 20000; ++i) {
    for (const std::uint8_t type : {1, 5, 9, 11})
      refused += !errorOf([&] { parseRecord(damaged(record(type, 1, 2, 3), &random)); }).empty();
    if (i % 10) continue;
    refused += !errorOf([&] { parseDepthFrame(damaged(depthMessage(32, 24, true, 2), &random)); }).empty();
    refused += !errorOf([&] { parseDepthFrame(damaged(depthMessage(32, 24, false, 0), &random)); }).empty();
    const Raw broken = damaged(Raw(text.begin(), text.end()), &random);
    refused += !errorOf([&] { complaints(parseHandshake(std::string(broken.begin(), broken.end()))); }).empty();
  }
  EXPECT_GT(refused, 20000);
}

}  // namespace
}  // namespace vip_slam::phone
