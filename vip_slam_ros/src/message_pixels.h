// SPDX-License-Identifier: BSD-3-Clause
// Images whose pixels lie in a message.
#pragma once

#include <boost/shared_ptr.hpp>
#include <opencv2/core.hpp>

namespace vip_slam {

/// An image on the memory of `view`, which `owner` keeps. The owner is let go with the last image that shares it.
cv::Mat withOwner(const cv::Mat& view, const boost::shared_ptr<const void>& owner);

}  // namespace vip_slam
