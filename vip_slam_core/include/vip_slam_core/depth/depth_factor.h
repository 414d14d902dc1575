// SPDX-License-Identifier: BSD-3-Clause
// In which unit a folder's 16-bit depth images are written, told from their values.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace vip_slam {

struct DepthFactor {
  double units_per_metre = 0;
  bool certain = false;  ///< the other unit would put the depth where no room has it
  std::string reason;    ///< for people, with the median that follows
};

/// Decides between millimetres and the 1/5000 m of the TUM RGB-D data set. `raw`: some of the images, 16UC1; 0 and
/// 65535 are no readings.
///   multiples of 5 almost throughout: a camera's millimetres written as 1/5000 m;
///   one reading in twenty beyond 13000: in millimetres farther than such cameras see;
///   else by the median, in which millimetres below 3600 are the more likely ones.
/// Throws std::invalid_argument when an image is of another type; without a reading 5000 is returned, not certain.
DepthFactor guessDepthFactor(const std::vector<cv::Mat>& raw);

}  // namespace vip_slam
