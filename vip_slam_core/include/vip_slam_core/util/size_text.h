// SPDX-License-Identifier: BSD-3-Clause
// Image sizes in messages.
#pragma once

#include <string>

#include <opencv2/core/types.hpp>

namespace vip_slam {

/// As in "640x480".
inline std::string sizeText(const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

}  // namespace vip_slam
