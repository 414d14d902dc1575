// SPDX-License-Identifier: BSD-3-Clause
// RVL, the lossless compression of 16-bit depth images of A. D. Wilson, "Fast lossless depth image compression" (ISS
// 2017). The pixels, row after row, are runs of zeros and of values in turn; a run is its length and, of values, the
// differences to the value before in zigzag order (0, -1, 1, -2, ...). Numbers are written in digits of three bits, the
// lowest first, each in a nibble whose highest bit says that another follows; eight nibbles, the first in the highest
// bits, make a 32-bit word, little endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace vip_slam {

/// `depth`: 16UC1; throws std::invalid_argument for another type.
std::vector<std::uint8_t> encodeRvl(const cv::Mat& depth);

/// 16UC1 of `size`. Throws std::invalid_argument when the data end early, or a run is longer than what is left of the
/// image.
cv::Mat decodeRvl(const std::uint8_t* data, std::size_t bytes, const cv::Size& size);

}  // namespace vip_slam
