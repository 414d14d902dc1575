// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/image_decoding.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/image_encodings.h>
#include <boost/make_shared.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "message_pixels.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/depth/rvl.h"

namespace vip_slam {
namespace {

namespace encodings = sensor_msgs::image_encodings;

std::string describe(const sensor_msgs::Image& image) {
  return "image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + ", encoding '" +
         image.encoding + "', step " + std::to_string(image.step) + ", " + std::to_string(image.data.size()) +
         " bytes: ";
}

/// The message's pixels; copied only when their bytes are in the other order.
cv_bridge::CvImageConstPtr share(const sensor_msgs::Image& image, const MessageOwner& owner) {
  if (image.width == 0 || image.height == 0) throw std::invalid_argument(describe(image) + "expected pixels");
  const cv_bridge::CvImageConstPtr shared = cv_bridge::toCvShare(image, owner);
  const int type = cv_bridge::getCvType(image.encoding);
  if (shared->image.type() == type) return shared;
  // cv_bridge up to 1.16 puts the bytes of the other order right, but leaves each a channel of its own.
  const cv::Mat& bytes = shared->image;
  const cv::Mat values(bytes.rows, bytes.cols, type, bytes.data, bytes.step);
  return boost::make_shared<cv_bridge::CvImage>(image.header, image.encoding, values.clone());
}

cv::Mat toMono8(const sensor_msgs::Image& image, const MessageOwner& owner) {
  const cv_bridge::CvImageConstPtr shared = share(image, owner);
  const std::string& e = image.encoding;
  if (e == encodings::MONO8 || e == encodings::TYPE_8UC1)
    return owner ? withOwner(shared->image, owner) : shared->image.clone();
  if (e != encodings::TYPE_8UC3 && e != encodings::TYPE_8UC4)
    return cv_bridge::cvtColor(shared, encodings::MONO8)->image;
  const std::string order = e == encodings::TYPE_8UC3 ? encodings::BGR8 : encodings::BGRA8;
  const auto named = boost::make_shared<cv_bridge::CvImage>(image.header, order, shared->image);
  return cv_bridge::cvtColor(named, encodings::MONO8)->image;
}

/// Unknown to cv_bridge.
cv::Mat yuy2ToMono8(const sensor_msgs::Image& image) {
  if (image.width == 0 || image.step < 2 * image.width || image.data.size() < std::size_t(image.step) * image.height)
    throw std::invalid_argument(describe(image) + "expected two bytes a pixel, and step x height bytes");
  const cv::Mat pixels(int(image.height), int(image.width), CV_8UC2, const_cast<std::uint8_t*>(image.data.data()),
                       image.step);
  cv::Mat gray;
  cv::cvtColor(pixels, gray, cv::COLOR_YUV2GRAY_YUY2);
  return gray;
}

bool isPng(const std::vector<std::uint8_t>& data, std::size_t at) {
  static const std::uint8_t signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  return data.size() > at + 8 && std::equal(signature, signature + 8, data.begin() + std::ptrdiff_t(at));
}

std::string describe(const sensor_msgs::CompressedImage& image) {
  return "compressed image of format '" + image.format + "' and " + std::to_string(image.data.size()) + " bytes";
}

/// compressedDepth stores 32FC1 as v = a / z + b; 0 stands for invalid.
cv::Mat inverseDepth(const cv::Mat& values, float a, float b, double offset) {
  cv::Mat depth(values.size(), CV_32FC1);
  for (int r = 0; r < values.rows; ++r) {
    const auto* v = values.ptr<std::uint16_t>(r);
    auto* z = depth.ptr<float>(r);
    for (int c = 0; c < values.cols; ++c) z[c] = v[c] == 0 ? 0.f : a / (float(v[c]) - b);
  }
  return depthToMetres(depth, 1.0, offset);
}

/// The pixels behind `at`: columns and rows as int32, then RVL.
cv::Mat rvlValues(const sensor_msgs::CompressedImage& image, std::size_t at) {
  constexpr std::int32_t kLargest = 1 << 14;  // px
  std::int32_t size[2] = {0, 0};
  if (image.data.size() >= at + sizeof size) std::memcpy(size, image.data.data() + at, sizeof size);
  for (const std::int32_t n : size)
    if (n <= 0 || n > kLargest)
      throw std::invalid_argument(describe(image) + ": no size before the RVL data, expected columns and rows");
  try {
    return decodeRvl(image.data.data() + at + sizeof size, image.data.size() - at - sizeof size, {size[0], size[1]});
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(describe(image) + ": " + error.what());
  }
}

/// The 16-bit pixels of a PNG that begins at `at`.
cv::Mat pngValues(const sensor_msgs::CompressedImage& image, std::size_t at) {
  if (!isPng(image.data, at))
    throw std::invalid_argument(describe(image) +
                                ": neither PNG nor RVL, expected a 16-bit PNG or compressedDepth of these");
  const cv::Mat encoded(1, int(image.data.size() - at), CV_8UC1, const_cast<std::uint8_t*>(image.data.data()) + at);
  const cv::Mat values = cv::imdecode(encoded, cv::IMREAD_UNCHANGED);
  if (values.empty() || values.type() != CV_16UC1)
    throw std::invalid_argument(describe(image) + ": " + (values.empty() ? "a damaged PNG" : "not one 16-bit channel") +
                                ", expected a 16-bit PNG");
  return values;
}

}  // namespace

cv::Mat GrayDecoder::operator()(const sensor_msgs::Image& image, const MessageOwner& owner) {
  try {
    if (image.encoding == encodings::MONO16) return narrowed(share(image, owner)->image);
    return image.encoding == "yuv422_yuy2" ? yuy2ToMono8(image) : toMono8(image, owner);
  } catch (const cv_bridge::Exception& error) {
    throw std::invalid_argument(describe(image) + error.what() +
                                "; expected mono8, mono16, rgb8, bgr8, rgba8, bgra8, yuv422, yuv422_yuy2 or Bayer");
  } catch (const cv::Exception& error) {  // what cv_bridge lets through, such as yuv422 of an odd width
    throw std::invalid_argument(describe(image) + error.what());
  }
}

cv::Mat GrayDecoder::operator()(const sensor_msgs::CompressedImage& image) {
  cv::Mat gray;
  // An image rotated by its EXIF tag would no longer fit the calibration; IMREAD_UNCHANGED never rotates.
  const int as_it_is = cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION;
  if (!image.data.empty()) gray = cv::imdecode(image.data, as_it_is);
  if (gray.empty()) throw std::invalid_argument(describe(image) + ": cannot be decoded, expected JPEG or PNG");
  return gray.type() == CV_16UC1 ? narrowed(gray) : gray;
}

cv::Mat GrayDecoder::narrowed(const cv::Mat& gray16) {
  double most = 0;
  cv::minMaxLoc(gray16, nullptr, &most);
  int needed = 8;
  while (needed < 16 && most >= 1 << needed) needed += 2;
  int bits = bits_;
  while (bits < needed && !bits_.compare_exchange_weak(bits, needed)) continue;
  bits = std::max(bits, needed);
  cv::Mat gray;
  gray16.convertTo(gray, CV_8U, 255.0 / ((1 << bits) - 1));
  return gray;
}

std::string GrayDecoder::note() const {
  const int bits = bits_;
  if (bits == 0 || bits == 16) return "";
  return "16-bit grey fills " + std::to_string(bits) + " bits, which are taken for the whole range";
}

cv::Mat decodeGray(const sensor_msgs::Image& image, const MessageOwner& owner) { return GrayDecoder()(image, owner); }

cv::Mat decodeGray(const sensor_msgs::CompressedImage& image) { return GrayDecoder()(image); }

cv::Mat decodeDepth(const sensor_msgs::Image& image, double scale, double offset) {
  const std::string& e = image.encoding;
  const bool metres = e == encodings::TYPE_32FC1;
  if (!metres && e != encodings::TYPE_16UC1 && e != encodings::MONO16)
    throw std::invalid_argument("depth encoding '" + e + "', expected 16UC1 or 32FC1");
  try {
    return depthToMetres(share(image, {})->image, metres ? 1.0 : scale, offset);
  } catch (const cv_bridge::Exception& error) {
    throw std::invalid_argument(describe(image) + error.what());
  }
}

cv::Mat decodeDepth(const sensor_msgs::CompressedImage& image, double scale, double offset) {
  constexpr std::size_t kHeader = 12;  // int32 kind, float a, float b: compressed_depth_image_transport
  const std::size_t begin = isPng(image.data, 0) ? 0 : kHeader;
  const bool rvl = begin != 0 && image.format.find("compressedDepth rvl") != std::string::npos;
  const cv::Mat values = rvl ? rvlValues(image, begin) : pngValues(image, begin);
  const bool quantised = begin != 0 && image.format.find(encodings::TYPE_32FC1) != std::string::npos;
  if (!quantised) return depthToMetres(values, scale, offset);
  float parameters[2];
  std::memcpy(parameters, image.data.data() + 4, sizeof parameters);
  return inverseDepth(values, parameters[0], parameters[1], offset);
}

bool holdsNoDepth(const cv::Mat& metres, const DepthNoise& noise) {
  constexpr int kStep = 8;
  constexpr double kNothing = 0.01, kOfReadings = 0.25;
  std::size_t all = 0, readings = 0, inside = 0;
  for (int v = 0; v < metres.rows; v += kStep) {
    for (int u = 0; u < metres.cols; u += kStep) {
      const float z = metres.at<float>(v, u);
      ++all;
      readings += z > 0;
      inside += noise.inRange(z);
    }
  }
  return double(inside) < kNothing * double(all) || double(inside) < kOfReadings * double(readings);
}

}  // namespace vip_slam
