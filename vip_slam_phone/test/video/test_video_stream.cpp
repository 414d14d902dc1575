// SPDX-License-Identifier: BSD-3-Clause
// Pictures coded, sent as RTP and received: what comes out is what went in, with its time.
#include <cmath>

#include <gtest/gtest.h>

#include "rtp_writer.h"
#include "video_encoder.h"
#include "vip_slam_phone/video/video_stream.h"

namespace vip_slam::phone {
namespace {

constexpr std::uint32_t kFirst = 0xffffe000u;  // the stamps wrap on the way
constexpr double kUnix = 1.7e9;

/// A pattern that moves by `k`.
cv::Mat scene(int k) {
  cv::Mat image(240, 320, CV_8UC3);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) {
      const auto grey = static_cast<std::uint8_t>(128 + 50 * std::sin((u + 2 * k) / 9.) + 40 * std::cos((v + k) / 7.));
      image.at<cv::Vec3b>(v, u) = {grey, grey, static_cast<std::uint8_t>(grey / 2)};
    }
  return image;
}

class PhoneVideoStream : public ::testing::TestWithParam<Codec> {
 protected:
  void SetUp() override {
    if (!VideoEncoder::available(GetParam())) GTEST_SKIP() << "libavcodec has no encoder for it";
    encoder_ = std::make_unique<VideoEncoder>(GetParam(), cv::Size(320, 240), 20, 4000000);
    writer_ = std::make_unique<RtpWriter>(GetParam());
    VideoTrack track;
    track.codec = GetParam();
    stream_ = std::make_unique<VideoStream>(track);
  }

  static std::uint32_t rtpOf(int k) { return kFirst + 4500u * k; }
  std::vector<std::vector<std::uint8_t>> picture(int k) {
    return writer_->packets(encoder_->encode(scene(k)), rtpOf(k));
  }
  std::vector<TimedImage> take(const std::vector<std::vector<std::uint8_t>>& packets) {
    std::vector<TimedImage> out;
    for (const auto& packet : packets)
      for (TimedImage& image : stream_->add(false, packet)) out.push_back(std::move(image));
    return out;
  }
  void report(int k) { stream_->add(true, RtpWriter::report(kUnix + k / 20., rtpOf(k))); }

  std::unique_ptr<VideoEncoder> encoder_;
  std::unique_ptr<RtpWriter> writer_;
  std::unique_ptr<VideoStream> stream_;
};

TEST_P(PhoneVideoStream, EveryPictureComesOutAtItsTime) {
  report(0);
  bool fragments = false;
  for (int k = 0; k < 45; ++k) {
    const auto packets = picture(k);
    fragments |= packets.size() > 5;
    const auto images = take(packets);
    ASSERT_EQ(images.size(), 1u) << k;
    EXPECT_NEAR(images[0].unix_time, kUnix + k / 20., 1e-5);
    ASSERT_EQ(images[0].bgr.size(), cv::Size(320, 240));
    EXPECT_LT(cv::norm(images[0].bgr, scene(k), cv::NORM_L1) / (3 * 320 * 240), 4) << k;
    EXPECT_GT(cv::norm(images[0].bgr, scene(k + 4), cv::NORM_L1) / (3 * 320 * 240), 8) << k;
  }
  EXPECT_TRUE(fragments);
  EXPECT_EQ(stream_->counts().pictures, 45u);
  EXPECT_EQ(stream_->counts().lost, 0u);
  EXPECT_EQ(stream_->counts().untimed, 0u);
}

TEST_P(PhoneVideoStream, ImagesBeforeTheFirstReportAreCounted) {
  for (int k = 0; k < 12; ++k) EXPECT_TRUE(take(picture(k)).empty());
  EXPECT_FALSE(stream_->reported());
  EXPECT_EQ(stream_->counts().untimed, 12u);
  report(12);
  EXPECT_TRUE(stream_->reported());
  const auto images = take(picture(12));
  ASSERT_EQ(images.size(), 1u);
  EXPECT_NEAR(images[0].unix_time, kUnix + 12 / 20., 1e-5);
  EXPECT_EQ(stream_->counts().untimed, 12u);
}

TEST_P(PhoneVideoStream, AfterALossNothingUntilTheNextKeyPicture) {
  report(0);
  std::vector<int> seen;
  for (int k = 0; k < 45; ++k) {
    auto packets = picture(k);
    if (k == 5) packets.erase(packets.begin());
    for (const TimedImage& image : take(packets)) seen.push_back(std::lround(20 * (image.unix_time - kUnix)));
  }
  // A key picture every 20.
  std::vector<int> expected;
  for (int k = 0; k < 45; ++k)
    if (k < 5 || k >= 20) expected.push_back(k);
  EXPECT_EQ(seen, expected);
  EXPECT_EQ(stream_->counts().lost, 1u);
}

INSTANTIATE_TEST_SUITE_P(, PhoneVideoStream, ::testing::Values(Codec::kH264, Codec::kHevc),
                         [](const auto& info) { return info.param == Codec::kH264 ? "H264" : "Hevc"; });

}  // namespace
}  // namespace vip_slam::phone
