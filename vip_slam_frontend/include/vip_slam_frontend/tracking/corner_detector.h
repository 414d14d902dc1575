// SPDX-License-Identifier: BSD-3-Clause
// FAST corners spread over the image by a grid: strong ones first, weaker ones where nothing strong is.
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_frontend/tracking/tracking_options.h"

namespace vip_slam {

struct Corner {
  cv::Point2f pixel;
  float score = 0;  ///< smaller eigenvalue of the mean structure tensor, grey levels^2
};

/// Up to `wanted` new corners, none nearer than min_distance to `occupied` or to each other: first the best of each
/// cell without an occupant, then the best of all. None where `mask` is zero; empty: anywhere.
std::vector<Corner> detectCorners(const cv::Mat& gray, const std::vector<cv::Point2f>& occupied, int wanted,
                                  const TrackingOptions& options, const cv::Mat& mask = cv::Mat());

/// Smaller eigenvalue of the structure tensor, averaged over the (2 radius + 1)^2 window; 0 outside the image.
float cornerScore(const cv::Mat& gray, int x, int y, int radius);

}  // namespace vip_slam
