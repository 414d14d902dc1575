// Converts images from drivers, recordings and phones to the front end's input: 8-bit gray, and depth in metres.
#pragma once

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <boost/shared_ptr.hpp>
#include <opencv2/core.hpp>

#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// What keeps a message alive, such as its ConstPtr.
using MessageOwner = boost::shared_ptr<const void>;

/// 8UC1. Accepts what cv_bridge makes mono8 of (mono8, mono16, rgb8, bgr8, rgba8, bgra8, yuv422, Bayer), also 8UC1,
/// 8UC3 and 8UC4 (taken for mono8, bgr8, bgra8) and yuv422_yuy2. With an `owner` of the message an image that is grey
/// already is not copied: the result keeps the owner, and its pixels, which others may read too, must not be written.
/// All decoders throw std::invalid_argument naming the encoding or size found and what was expected.
cv::Mat decodeGray(const sensor_msgs::Image& image, const MessageOwner& owner = {});
/// JPEG or PNG.
cv::Mat decodeGray(const sensor_msgs::CompressedImage& image);

/// 32FC1 metres, 0 = invalid. Accepts 16UC1 and mono16 (times `scale` metres per unit) and 32FC1 (metres); `offset`
/// metres are added to every reading.
cv::Mat decodeDepth(const sensor_msgs::Image& image, double scale, double offset = 0);
/// 16-bit PNG, bare or behind the 12-byte header of compressedDepth (16UC1, or 32FC1 quantised as inverse depth).
cv::Mat decodeDepth(const sensor_msgs::CompressedImage& image, double scale, double offset = 0);

/// Whether a depth image (32FC1 metres) has hardly any values within the sensor's range, or most of them outside of it,
/// judged on a sample of its pixels: a wrong scale or order of bytes, another topic, an emitter that is off.
bool holdsNoDepth(const cv::Mat& metres, const DepthNoise& noise);

}  // namespace vip_slam
