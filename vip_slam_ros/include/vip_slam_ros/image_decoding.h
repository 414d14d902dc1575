// SPDX-License-Identifier: BSD-3-Clause
// Converts images from drivers, recordings and phones to the front end's input: 8-bit gray, and depth in metres.
#pragma once

#include <atomic>
#include <string>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <boost/shared_ptr.hpp>
#include <opencv2/core.hpp>

#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// What keeps a message alive, such as its ConstPtr.
using MessageOwner = boost::shared_ptr<const void>;

/// The grey images of one camera, as 8UC1. Drivers put 10, 12, 14 or 16 bits into 16-bit pixels: white is the largest
/// number of as many bits as one of the camera's pixels had so far, so that brightness does not change from image to
/// image. May be used from several threads.
class GrayDecoder {
 public:
  /// Accepts what cv_bridge makes mono8 of (mono8, mono16, rgb8, bgr8, rgba8, bgra8, yuv422, Bayer), also 8UC1, 8UC3
  /// and 8UC4 (taken for mono8, bgr8, bgra8), and yuv422_yuy2. With an `owner` of the message an
  /// image that is grey already is not copied: the result keeps the owner, and its pixels, which others may read too,
  /// must not be written. All decoders throw std::invalid_argument naming the encoding or size found and what was
  /// expected.
  cv::Mat operator()(const sensor_msgs::Image& image, const MessageOwner& owner = {});
  /// JPEG or PNG.
  cv::Mat operator()(const sensor_msgs::CompressedImage& image);

  /// Bits that 16-bit pixels fill so far; 0: none came.
  int bits() const { return bits_; }
  /// That a camera's 16-bit pixels do not use 16 bits, in words; else empty.
  std::string note() const;

 private:
  cv::Mat narrowed(const cv::Mat& gray16);
  std::atomic<int> bits_{0};
};

/// One image that stands alone, by a decoder of its own.
cv::Mat decodeGray(const sensor_msgs::Image& image, const MessageOwner& owner = {});
cv::Mat decodeGray(const sensor_msgs::CompressedImage& image);

/// 32FC1 metres, 0 = invalid. Accepts 16UC1 and mono16 (times `scale` metres per unit) and 32FC1 (metres); `offset`
/// metres are added to every reading.
cv::Mat decodeDepth(const sensor_msgs::Image& image, double scale, double offset = 0);
/// 16-bit PNG, bare or behind the 12-byte header of compressedDepth, or RVL behind that header and its own of columns
/// and rows ("compressedDepth rvl" in the format); 16UC1, or 32FC1 quantised as inverse depth.
cv::Mat decodeDepth(const sensor_msgs::CompressedImage& image, double scale, double offset = 0);

/// Whether a depth image (32FC1 metres) has hardly any values within the sensor's range, or most of them outside of it,
/// judged on a sample of its pixels: a wrong scale or order of bytes, another topic, an emitter that is off.
bool holdsNoDepth(const cv::Mat& metres, const DepthNoise& noise);

}  // namespace vip_slam
