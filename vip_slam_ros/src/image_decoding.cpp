#include "vip_slam_ros/image_decoding.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include <sensor_msgs/image_encodings.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/depth/depth_image.h"

namespace vip_slam {
namespace {

namespace encodings = sensor_msgs::image_encodings;

/// A view of the message's pixels without copying, with its size checked.
cv::Mat view(const sensor_msgs::Image& image, int type) {
  const std::size_t row = std::size_t(image.width) * CV_ELEM_SIZE(type);
  if (image.width == 0 || image.height == 0 || image.step < row ||
      image.data.size() < std::size_t(image.step) * image.height) {
    throw std::invalid_argument("image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + " " +
                                image.encoding + " with step " + std::to_string(image.step) + " and " +
                                std::to_string(image.data.size()) + " bytes, expected step >= " + std::to_string(row) +
                                " and step x height bytes");
  }
  return cv::Mat(int(image.height), int(image.width), type, const_cast<std::uint8_t*>(image.data.data()), image.step);
}

cv::Mat convert(const cv::Mat& source, int code) {
  cv::Mat gray;
  cv::cvtColor(source, gray, code);
  return gray;
}

/// Sixteen-bit values in this machine's byte order.
cv::Mat view16(const sensor_msgs::Image& image) {
  cv::Mat values = view(image, CV_16UC1);
  const std::uint16_t one = 1;
  const bool machine_is_big = *reinterpret_cast<const std::uint8_t*>(&one) == 0;
  if (bool(image.is_bigendian) == machine_is_big) return values;
  values = values.clone();
  values.forEach<std::uint16_t>([](std::uint16_t& v, const int*) { v = std::uint16_t((v << 8) | (v >> 8)); });
  return values;
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

}  // namespace

cv::Mat decodeGray(const sensor_msgs::Image& image) {
  const std::string& e = image.encoding;
  if (e == encodings::MONO8 || e == encodings::TYPE_8UC1) return view(image, CV_8UC1).clone();
  if (e == encodings::RGB8) return convert(view(image, CV_8UC3), cv::COLOR_RGB2GRAY);
  if (e == encodings::BGR8 || e == encodings::TYPE_8UC3) return convert(view(image, CV_8UC3), cv::COLOR_BGR2GRAY);
  if (e == encodings::RGBA8) return convert(view(image, CV_8UC4), cv::COLOR_RGBA2GRAY);
  if (e == encodings::BGRA8 || e == encodings::TYPE_8UC4) return convert(view(image, CV_8UC4), cv::COLOR_BGRA2GRAY);
  if (e == encodings::YUV422) return convert(view(image, CV_8UC2), cv::COLOR_YUV2GRAY_UYVY);
  if (e == "yuv422_yuy2") return convert(view(image, CV_8UC2), cv::COLOR_YUV2GRAY_YUY2);
  if (e == encodings::BAYER_RGGB8) return convert(view(image, CV_8UC1), cv::COLOR_BayerBG2GRAY);
  if (e == encodings::BAYER_BGGR8) return convert(view(image, CV_8UC1), cv::COLOR_BayerRG2GRAY);
  if (e == encodings::BAYER_GBRG8) return convert(view(image, CV_8UC1), cv::COLOR_BayerGR2GRAY);
  if (e == encodings::BAYER_GRBG8) return convert(view(image, CV_8UC1), cv::COLOR_BayerGB2GRAY);
  if (e == encodings::MONO16) {
    cv::Mat gray;
    view16(image).convertTo(gray, CV_8UC1, 1.0 / 256.0);
    return gray;
  }
  throw std::invalid_argument("image encoding '" + e +
                              "', expected mono8, mono16, rgb8, bgr8, rgba8, bgra8, yuv422, "
                              "yuv422_yuy2 or an 8-bit Bayer pattern");
}

cv::Mat decodeGray(const sensor_msgs::CompressedImage& image) {
  cv::Mat gray;
  // An image rotated by its EXIF tag would no longer fit the calibration; IMREAD_UNCHANGED never rotates.
  if (!image.data.empty()) gray = cv::imdecode(image.data, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  if (gray.empty()) throw std::invalid_argument(describe(image) + ": cannot be decoded, expected JPEG or PNG");
  return gray;
}

cv::Mat decodeDepth(const sensor_msgs::Image& image, double scale, double offset) {
  const std::string& e = image.encoding;
  if (e == encodings::TYPE_16UC1 || e == encodings::MONO16) return depthToMetres(view16(image), scale, offset);
  if (e == encodings::TYPE_32FC1) {
    if (image.is_bigendian) throw std::invalid_argument("32FC1 depth in big-endian order, expected little-endian");
    return depthToMetres(view(image, CV_32FC1), 1.0, offset);
  }
  throw std::invalid_argument("depth encoding '" + e + "', expected 16UC1 or 32FC1");
}

cv::Mat decodeDepth(const sensor_msgs::CompressedImage& image, double scale, double offset) {
  constexpr std::size_t kHeader = 12;  // int32 kind, float a, float b: compressed_depth_image_transport
  const std::size_t begin = isPng(image.data, 0) ? 0 : kHeader;
  if (!isPng(image.data, begin)) {
    throw std::invalid_argument(describe(image) + ": no PNG in it, expected a 16-bit PNG or compressedDepth with PNG");
  }
  const cv::Mat encoded(1, int(image.data.size() - begin), CV_8UC1,
                        const_cast<std::uint8_t*>(image.data.data()) + begin);
  const cv::Mat values = cv::imdecode(encoded, cv::IMREAD_UNCHANGED);
  if (values.empty() || values.type() != CV_16UC1) {
    throw std::invalid_argument(describe(image) + ": " + (values.empty() ? "a damaged PNG" : "not one 16-bit channel") +
                                ", expected a 16-bit PNG");
  }
  const bool quantised = begin != 0 && image.format.find(encodings::TYPE_32FC1) != std::string::npos;
  if (!quantised) return depthToMetres(values, scale, offset);
  float parameters[2];
  std::memcpy(parameters, image.data.data() + 4, sizeof parameters);
  return inverseDepth(values, parameters[0], parameters[1], offset);
}

bool holdsNoDepth(const cv::Mat& metres, const DepthNoise& noise) {
  constexpr int kStep = 8;
  constexpr double kNothing = 0.01;
  std::size_t all = 0, inside = 0;
  for (int v = 0; v < metres.rows; v += kStep) {
    for (int u = 0; u < metres.cols; u += kStep) {
      ++all;
      inside += noise.inRange(metres.at<float>(v, u));
    }
  }
  return double(inside) < kNothing * double(all);
}

}  // namespace vip_slam
