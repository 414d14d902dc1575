// SPDX-License-Identifier: BSD-3-Clause
// The image with its tracked features and the tracking state, for display.
#pragma once

#include <opencv2/core.hpp>

#include "vip_slam_core/types/keyframe.h"

namespace vip_slam {

/// BGR. Features with depth are coloured by it (near red, far blue), those without are white rings; larger dots are
/// older. The state and its reason are written at the bottom, in green, yellow or red.
cv::Mat drawFeatureImage(const cv::Mat& gray, const TrackedFrame& frame);

}  // namespace vip_slam
