// SPDX-License-Identifier: BSD-3-Clause
#include "feature_image.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <opencv2/imgproc.hpp>

namespace vip_slam {
namespace {

/// From red at half a metre via yellow and green to blue at eight metres, with equal steps per doubling of the
/// distance.
cv::Scalar depthColour(float z) {
  const float s = std::clamp(std::log2(8.0f / z) / 4.0f, 0.0f, 1.0f);
  const cv::Mat hsv(1, 1, CV_8UC3, cv::Scalar(120 * (1 - s), 220, 255));
  cv::Mat bgr;
  cv::cvtColor(hsv, bgr, cv::COLOR_HSV2BGR);
  const auto c = bgr.at<cv::Vec3b>(0, 0);
  return cv::Scalar(c[0], c[1], c[2]);
}

cv::Scalar stateColour(TrackingState state) {
  switch (state) {
    case TrackingState::kTracking:
      return {80, 220, 80};
    case TrackingState::kLost:
      return {60, 60, 240};
    default:
      return {40, 220, 240};
  }
}

}  // namespace

cv::Mat drawFeatureImage(const cv::Mat& gray, const TrackedFrame& frame) {
  cv::Mat picture;
  cv::cvtColor(gray, picture, cv::COLOR_GRAY2BGR);
  for (const Feature& feature : frame.features) {
    const cv::Point2f at(feature.pixel.x(), feature.pixel.y());
    const int radius = feature.age > 20 ? 4 : feature.age > 5 ? 3 : 2;
    if (feature.depth > 0) {
      cv::circle(picture, at, radius, depthColour(feature.depth), cv::FILLED, cv::LINE_AA);
      cv::circle(picture, at, radius, cv::Scalar(20, 20, 20), 1, cv::LINE_AA);
    } else {
      cv::circle(picture, at, radius, cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
    }
  }
  std::string words = trackingStateName(frame.status.state);
  words += "  " + std::to_string(frame.features.size()) + " features";
  if (frame.zero_velocity) words += "  standing still";
  if (!frame.status.reason.empty()) words += "  " + frame.status.reason;
  const double scale = picture.cols / 1280.0 + 0.1;
  const int strip = std::max(16, int(48 * scale));
  cv::Mat bottom = picture.rowRange(std::max(0, picture.rows - strip), picture.rows);
  bottom *= 0.35;
  cv::putText(picture, words, {8, picture.rows - strip / 3}, cv::FONT_HERSHEY_SIMPLEX, scale,
              stateColour(frame.status.state), 1, cv::LINE_AA);
  return picture;
}

}  // namespace vip_slam
