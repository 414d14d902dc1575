// SPDX-License-Identifier: BSD-3-Clause
// Every encoding that a driver may send gives the same gray or depth image; unreadable ones are named in the error.
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include <gtest/gtest.h>
#include <boost/make_shared.hpp>
#include <boost/weak_ptr.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/depth/rvl.h"
#include "vip_slam_ros/image_decoding.h"

namespace vip_slam {
namespace {

sensor_msgs::Image toImage(const cv::Mat& pixels, const std::string& encoding) {
  sensor_msgs::Image image;
  image.width = std::uint32_t(pixels.cols);
  image.height = std::uint32_t(pixels.rows);
  image.encoding = encoding;
  image.step = std::uint32_t(pixels.cols * pixels.elemSize());
  image.data.assign(pixels.data, pixels.data + image.step * image.height);
  return image;
}

/// A smooth colour picture.
cv::Mat picture() {
  cv::Mat bgr(48, 64, CV_8UC3);
  for (int r = 0; r < bgr.rows; ++r) {
    for (int c = 0; c < bgr.cols; ++c) bgr.at<cv::Vec3b>(r, c) = {uchar(c * 3), uchar(r * 4), uchar(100 + c)};
  }
  return bgr;
}

cv::Mat depthUnits() {
  cv::Mat depth(48, 64, CV_16UC1);
  for (int r = 0; r < depth.rows; ++r) {
    for (int c = 0; c < depth.cols; ++c) depth.at<std::uint16_t>(r, c) = std::uint16_t(500 + 50 * r + c);
  }
  depth.at<std::uint16_t>(3, 4) = 0;
  return depth;
}

double difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

TEST(DecodeGray, ColourEncodingsAgree) {
  const cv::Mat bgr = picture();
  cv::Mat gray, rgb, rgba, bgra;
  cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  cv::cvtColor(bgr, rgba, cv::COLOR_BGR2RGBA);
  cv::cvtColor(bgr, bgra, cv::COLOR_BGR2BGRA);
  EXPECT_EQ(difference(decodeGray(toImage(bgr, "bgr8")), gray), 0);
  EXPECT_EQ(difference(decodeGray(toImage(rgb, "rgb8")), gray), 0);
  EXPECT_EQ(difference(decodeGray(toImage(rgba, "rgba8")), gray), 0);
  EXPECT_EQ(difference(decodeGray(toImage(bgra, "bgra8")), gray), 0);
  EXPECT_EQ(difference(decodeGray(toImage(gray, "mono8")), gray), 0);
  cv::Mat deep;
  gray.convertTo(deep, CV_16UC1, 257);  // white is 65535
  EXPECT_EQ(difference(decodeGray(toImage(deep, "mono16")), gray), 0);
}

TEST(DecodeGray, SixteenBitGreyIsScaledByWhatItFills) {
  cv::Mat gray;
  cv::cvtColor(picture(), gray, cv::COLOR_BGR2GRAY);
  gray.at<std::uint8_t>(0, 0) = 255;
  for (const int bits : {8, 10, 12, 14, 16}) {
    cv::Mat deep;
    gray.convertTo(deep, CV_16UC1, ((1 << bits) - 1) / 255.0);
    GrayDecoder decoder;
    EXPECT_LE(difference(decoder(toImage(deep, "mono16")), gray), 1) << bits;
    EXPECT_EQ(decoder.bits(), bits);
    EXPECT_EQ(decoder.note().empty(), bits == 16) << decoder.note();
    sensor_msgs::CompressedImage png;
    png.format = "mono16; png compressed ";
    cv::imencode(".png", deep, png.data);
    EXPECT_LE(difference(GrayDecoder()(png), gray), 1) << bits;
  }
  // A darker image after that keeps the scale: its greys are not stretched.
  cv::Mat deep;
  gray.convertTo(deep, CV_16UC1, 1023 / 255.0);
  GrayDecoder decoder;
  decoder(toImage(deep, "mono16"));
  EXPECT_LE(difference(decoder(toImage(cv::Mat(deep / 8), "mono16")), gray / 8), 1);
  EXPECT_EQ(decoder.bits(), 10);
  decoder(toImage(gray, "mono8"));
  EXPECT_EQ(decoder.note(), "16-bit grey fills 10 bits, which are taken for the whole range");
  EXPECT_EQ(GrayDecoder().note(), "");
}

TEST(DecodeGray, UnnamedChannelsAreTakenForBlueGreenRed) {
  const cv::Mat bgr = picture();
  cv::Mat gray, bgra;
  cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
  cv::cvtColor(bgr, bgra, cv::COLOR_BGR2BGRA);
  EXPECT_EQ(difference(decodeGray(toImage(gray, "8UC1")), gray), 0);
  EXPECT_EQ(difference(decodeGray(toImage(bgr, "8UC3")), gray), 0);
  EXPECT_EQ(difference(decodeGray(toImage(bgra, "8UC4")), gray), 0);
}

// The image of a camera that sends grey is the message's memory, and keeps it for as long as anybody has the image.
TEST(DecodeGray, AGreyMessageIsSharedAndKept) {
  cv::Mat gray;
  cv::cvtColor(picture(), gray, cv::COLOR_BGR2GRAY);
  auto message = boost::make_shared<const sensor_msgs::Image>(toImage(gray, "mono8"));
  const boost::weak_ptr<const sensor_msgs::Image> watch = message;
  cv::Mat image = decodeGray(*message, message), second = image;
  EXPECT_EQ(image.data, message->data.data());
  message.reset();
  image.release();
  ASSERT_FALSE(watch.expired());
  EXPECT_EQ(difference(second, gray), 0);
  cv::Mat part = second.rowRange(0, 4);
  second = cv::Mat();
  EXPECT_FALSE(watch.expired());
  part.create(100, 100, CV_8UC1);  // memory of its own: the last one lets go of the message
  part.setTo(7);
  EXPECT_TRUE(watch.expired());
}

TEST(DecodeGray, WithoutAnOwnerTheImageIsACopy) {
  sensor_msgs::Image message = toImage(cv::Mat(4, 4, CV_8UC1, cv::Scalar(9)), "mono8");
  const cv::Mat image = decodeGray(message);
  message.data.assign(message.data.size(), 0);
  EXPECT_EQ(image.at<uchar>(3, 3), 9);
}

TEST(DecodeGray, YuvKeepsTheLuminance) {
  cv::Mat uyvy(4, 6, CV_8UC2), yuy2(4, 6, CV_8UC2);
  for (int i = 0; i < 24; ++i) {
    uyvy.at<cv::Vec2b>(i / 6, i % 6) = {128, uchar(10 * i)};
    yuy2.at<cv::Vec2b>(i / 6, i % 6) = {uchar(10 * i), 128};
  }
  for (const cv::Mat& gray : {decodeGray(toImage(uyvy, "yuv422")), decodeGray(toImage(yuy2, "yuv422_yuy2"))}) {
    for (int i = 0; i < 24; ++i) EXPECT_EQ(gray.at<uchar>(i / 6, i % 6), 10 * i);
  }
}

TEST(DecodeGray, RowsWithPadding) {
  sensor_msgs::Image image = toImage(picture(), "bgr8");
  sensor_msgs::Image padded = image;
  padded.step = image.step + 7;
  padded.data.assign(padded.step * padded.height, 0);
  for (std::uint32_t r = 0; r < image.height; ++r) {
    std::memcpy(&padded.data[r * padded.step], &image.data[r * image.step], image.step);
  }
  EXPECT_EQ(difference(decodeGray(padded), decodeGray(image)), 0);
}

TEST(DecodeGray, Compressed) {
  cv::Mat gray;
  cv::cvtColor(picture(), gray, cv::COLOR_BGR2GRAY);
  sensor_msgs::CompressedImage png, jpeg;
  cv::imencode(".png", picture(), png.data);
  cv::imencode(".jpg", picture(), jpeg.data, {cv::IMWRITE_JPEG_QUALITY, 98});
  EXPECT_LE(difference(decodeGray(png), gray), 1);
  EXPECT_LE(difference(decodeGray(jpeg), gray), 12);
}

TEST(DecodeGray, TheExifOrientationTurnsNothing) {
  const cv::Mat bgr = picture();
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", bgr, jpeg);
  // An APP1 segment right after the start of the image: EXIF, big endian, orientation 6 (turned by a quarter).
  const std::vector<std::uint8_t> exif = {0xff, 0xe1, 0, 34, 'E', 'x', 'i', 'f', 0,    0,    'M', 'M',
                                          0,    42,   0, 0,  0,   8,   0,   1,   0x01, 0x12, 0,   3,
                                          0,    0,    0, 1,  0,   6,   0,   0,   0,    0,    0,   0};
  jpeg.insert(jpeg.begin() + 2, exif.begin(), exif.end());
  ASSERT_EQ(cv::imdecode(jpeg, cv::IMREAD_GRAYSCALE).rows, bgr.cols) << "the tag is not understood";
  sensor_msgs::CompressedImage image;
  image.format = "jpeg";
  image.data = jpeg;
  EXPECT_EQ(decodeGray(image).size(), bgr.size());
}

TEST(DecodeDepth, RawAndCompressedAgree) {
  const cv::Mat units = depthUnits();
  cv::Mat metres;
  units.convertTo(metres, CV_32FC1, 0.001);
  EXPECT_LT(difference(decodeDepth(toImage(units, "16UC1"), 0.001), metres), 1e-6);
  EXPECT_LT(difference(decodeDepth(toImage(metres, "32FC1"), 0.001), metres), 1e-9);

  sensor_msgs::CompressedImage bare, headed;
  bare.format = "png";
  cv::imencode(".png", units, bare.data);
  EXPECT_LT(difference(decodeDepth(bare, 0.001), metres), 1e-6);
  headed.format = "16UC1; compressedDepth png";
  headed.data.assign(12, 0);
  headed.data.insert(headed.data.end(), bare.data.begin(), bare.data.end());
  EXPECT_LT(difference(decodeDepth(headed, 0.001), metres), 1e-6);
}

TEST(DecodeDepth, TheOffsetIsAddedWhateverTheEncoding) {
  const cv::Mat units = depthUnits();
  cv::Mat metres;
  units.convertTo(metres, CV_32FC1, 0.001);
  const cv::Mat expected = depthToMetres(units, 0.001, -0.02);
  ASSERT_GT(difference(expected, metres), 0.01);
  EXPECT_LT(difference(decodeDepth(toImage(units, "16UC1"), 0.001, -0.02), expected), 1e-6);
  EXPECT_LT(difference(decodeDepth(toImage(metres, "32FC1"), 0.001, -0.02), expected), 1e-6);
  sensor_msgs::CompressedImage image;
  image.format = "png";
  cv::imencode(".png", units, image.data);
  EXPECT_LT(difference(decodeDepth(image, 0.001, -0.02), expected), 1e-6);
  // v = a / z, as compressed_depth_image_transport writes 32FC1.
  const float a = 2000, b = 0;
  std::vector<std::uint8_t> png;
  cv::imencode(".png", cv::Mat(1, 1, CV_16UC1, cv::Scalar(1000)), png);
  image.format = "32FC1; compressedDepth png";
  image.data.assign(12, 0);
  std::memcpy(&image.data[4], &a, 4);
  std::memcpy(&image.data[8], &b, 4);
  image.data.insert(image.data.end(), png.begin(), png.end());
  EXPECT_NEAR(decodeDepth(image, 0.001, -0.02).at<float>(0, 0), 1.98, 1e-6);
}

TEST(DecodeDepth, OtherByteOrder) {
  const cv::Mat units = depthUnits();
  sensor_msgs::Image swapped = toImage(units, "16UC1");
  for (std::size_t i = 0; i + 1 < swapped.data.size(); i += 2) std::swap(swapped.data[i], swapped.data[i + 1]);
  swapped.is_bigendian = 1;
  EXPECT_EQ(difference(decodeDepth(swapped, 0.001), decodeDepth(toImage(units, "16UC1"), 0.001)), 0);
  cv::Mat metres;
  units.convertTo(metres, CV_32FC1, 0.001);
  sensor_msgs::Image floats = toImage(metres, "32FC1");
  for (std::size_t i = 0; i + 3 < floats.data.size(); i += 4) {
    std::swap(floats.data[i], floats.data[i + 3]);
    std::swap(floats.data[i + 1], floats.data[i + 2]);
  }
  floats.is_bigendian = 1;
  EXPECT_EQ(difference(decodeDepth(floats, 0.001), decodeDepth(toImage(metres, "32FC1"), 0.001)), 0);
}

TEST(DecodeDepth, QuantisedInverseDepth) {
  // v = a / z + b, as compressed_depth_image_transport writes 32FC1.
  const float a = 1000, b = 20;
  cv::Mat values(2, 2, CV_16UC1);
  const float z[4] = {1.0f, 2.0f, 4.0f, 0.0f};
  for (int i = 0; i < 4; ++i) values.at<std::uint16_t>(i / 2, i % 2) = std::uint16_t(z[i] > 0 ? a / z[i] + b : 0);
  sensor_msgs::CompressedImage image;
  image.format = "32FC1; compressedDepth png";
  std::vector<std::uint8_t> png;
  cv::imencode(".png", values, png);
  image.data.assign(12, 0);
  std::memcpy(&image.data[4], &a, 4);
  std::memcpy(&image.data[8], &b, 4);
  image.data.insert(image.data.end(), png.begin(), png.end());
  const cv::Mat depth = decodeDepth(image, 0.001);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(depth.at<float>(i / 2, i % 2), z[i], 1e-4);
}

/// As compressed_depth_image_transport sends it: its header, then columns and rows, then the pixels.
sensor_msgs::CompressedImage rvlImage(const cv::Mat& values, const std::string& encoding, float a, float b) {
  sensor_msgs::CompressedImage image;
  image.format = encoding + "; compressedDepth rvl";
  image.data.assign(20, 0);
  const std::int32_t size[2] = {values.cols, values.rows};
  std::memcpy(&image.data[4], &a, 4);
  std::memcpy(&image.data[8], &b, 4);
  std::memcpy(&image.data[12], size, 8);
  const std::vector<std::uint8_t> pixels = encodeRvl(values);
  image.data.insert(image.data.end(), pixels.begin(), pixels.end());
  return image;
}

TEST(DecodeDepth, RvlIsReadAsPngIs) {
  const cv::Mat units = depthUnits();
  cv::Mat metres;
  units.convertTo(metres, CV_32FC1, 0.001);
  EXPECT_LT(difference(decodeDepth(rvlImage(units, "16UC1", 0, 0), 0.001), metres), 1e-6);
  EXPECT_LT(difference(decodeDepth(rvlImage(units, "16UC1", 0, 0), 0.001, 0.02), depthToMetres(units, 0.001, 0.02)),
            1e-6);
  const float a = 1000, b = 20;
  const cv::Mat values = (cv::Mat_<std::uint16_t>(2, 2) << 1020, 520, 270, 0);
  const cv::Mat depth = decodeDepth(rvlImage(values, "32FC1", a, b), 0.001);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(depth.at<float>(i / 2, i % 2), i < 3 ? 1 << i : 0, 1e-4);

  const auto refused = [](sensor_msgs::CompressedImage image, const std::string& words) {
    try {
      decodeDepth(image, 0.001);
      ADD_FAILURE() << words;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  sensor_msgs::CompressedImage image = rvlImage(units, "16UC1", 0, 0);
  image.data.resize(image.data.size() / 2);
  refused(image, "the data end early");
  image.data.resize(15);
  refused(image, "no size before the RVL data");
  image = rvlImage(units, "16UC1", 0, 0);
  image.data[15] = 0x7f;  // two thousand million columns
  refused(image, "no size before the RVL data");
  image.format = "16UC1; compressedDepth";
  refused(image, "neither PNG nor RVL");
}

TEST(DecodeDepth, NotANumberIsInvalid) {
  cv::Mat metres(2, 2, CV_32FC1, cv::Scalar(1.5));
  metres.at<float>(0, 1) = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat depth = decodeDepth(toImage(metres, "32FC1"), 1.0);
  EXPECT_EQ(depth.at<float>(0, 0), 1.5f);
  EXPECT_EQ(depth.at<float>(0, 1), 0.0f);
}

template <class Call>
void expectNamed(Call call, const std::string& word) {
  try {
    call();
    FAIL() << "taken, expected an error that names " << word;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
  }
}

TEST(Decode, UnusableImagesAreNamed) {
  expectNamed([] { decodeGray(toImage(picture(), "magic8")); }, "magic8");
  expectNamed([] { decodeDepth(toImage(picture(), "rgb8"), 1); }, "rgb8");
  sensor_msgs::Image cut = toImage(picture(), "bgr8");
  cut.data.resize(100);
  expectNamed([&] { decodeGray(cut); }, "100 bytes");
  expectNamed([] { decodeGray(sensor_msgs::Image()); }, "encoding");
  expectNamed([] { decodeGray(toImage(depthUnits(), "16UC1")); }, "16UC1");
  cut.encoding = "yuv422_yuy2";
  expectNamed([&] { decodeGray(cut); }, "100 bytes");
  sensor_msgs::Image short_rows = toImage(depthUnits(), "16UC1");
  short_rows.step = 3;
  expectNamed([&] { decodeDepth(short_rows, 1); }, "step 3");
  sensor_msgs::CompressedImage garbage;
  garbage.format = "jpeg";
  garbage.data = {1, 2, 3};
  expectNamed([&] { decodeGray(garbage); }, "jpeg");
  expectNamed([&] { decodeDepth(garbage, 1); }, "PNG");
  sensor_msgs::CompressedImage eight_bit;
  cv::imencode(".png", picture(), eight_bit.data);
  expectNamed([&] { decodeDepth(eight_bit, 1); }, "16-bit");
}

TEST(Decode, DepthOutsideOfTheSensorsRangeIsNone) {
  DepthNoise noise;
  noise.min_range = 0.3, noise.max_range = 6;
  EXPECT_FALSE(holdsNoDepth(cv::Mat(480, 640, CV_32FC1, cv::Scalar(2.0)), noise));
  EXPECT_TRUE(holdsNoDepth(cv::Mat(480, 640, CV_32FC1, cv::Scalar(2000.0)), noise)) << "millimetres";
  EXPECT_TRUE(holdsNoDepth(cv::Mat(480, 640, CV_32FC1, cv::Scalar(0)), noise));
}

TEST(Decode, DepthWhoseBytesAreChangedOverIsNone) {
  DepthNoise noise;
  noise.min_range = 0.3, noise.max_range = 6;
  cv::Mat wall(480, 640, CV_16UC1), swapped(480, 640, CV_16UC1);
  for (int v = 0; v < wall.rows; ++v) {
    for (int u = 0; u < wall.cols; ++u) {
      const int z = 2000 + 3 * u + 2 * v + (u * 7 + v * 5) % 11;  // mm: slanting, with some noise
      wall.at<std::uint16_t>(v, u) = std::uint16_t(z);
      swapped.at<std::uint16_t>(v, u) = std::uint16_t(z << 8 | z >> 8);
    }
  }
  const auto metres = [](const cv::Mat& raw) {
    cv::Mat out;
    raw.convertTo(out, CV_32F, 0.001);
    return out;
  };
  EXPECT_FALSE(holdsNoDepth(metres(wall), noise));
  EXPECT_TRUE(holdsNoDepth(metres(swapped), noise));
}

}  // namespace
}  // namespace vip_slam
