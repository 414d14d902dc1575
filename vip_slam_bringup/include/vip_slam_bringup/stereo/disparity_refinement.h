// SPDX-License-Identifier: BSD-3-Clause
// Sub-pixel refinement of a disparity image by the images' own intensities: one Lucas-Kanade step along the rows.
//
// Semi-global matching selects whole pixels and interpolates costs, and its smoothness penalty turns slanted surfaces
// into steps: 0.12 px of median error on a wall at 24 degrees, half of it bias. With the right image warped by the
// disparity d, left(x) - right(x - d) is the error that a step delta explains as -delta right'(x - d); delta is the
// least-squares solution over a window. The warp follows the surface, so the window need not be fronto-parallel.
#pragma once

#include <opencv2/core.hpp>

namespace vip_slam {

/// `left`, `right`: rectified, CV_8UC1. `disparity`: CV_16SC1 in sixteenths of a pixel, not positive where unknown;
/// changed in place by less than 0.6 px where the window (`window` px square) has texture along the rows.
void refineDisparity(const cv::Mat& left, const cv::Mat& right, int window, cv::Mat* disparity);

}  // namespace vip_slam
