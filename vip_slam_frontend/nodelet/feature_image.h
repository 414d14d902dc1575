// The picture users look at first: the image with its tracked features and the tracking state.
#pragma once

#include <opencv2/core.hpp>

#include "vip_slam_core/types/keyframe.h"

namespace vip_slam {

/// BGR. Features with depth are coloured by it (near red, far blue), those without are white rings; larger dots have
/// lived longer. The state and its reason stand at the bottom, in green, yellow or red.
cv::Mat drawFeatureImage(const cv::Mat& gray, const TrackedFrame& frame);

}  // namespace vip_slam
