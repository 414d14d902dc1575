// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/stereo/disparity_refinement.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vip_slam {
namespace {

constexpr float kLargestStep = 0.6f;  // px; a larger step means that the match itself is wrong
constexpr float kMinGradient = 2.4f;  // mean square, (grey levels / px)^2: well above that of image noise

}  // namespace

void refineDisparity(const cv::Mat& left, const cv::Mat& right, int window, cv::Mat* disparity) {
  cv::Mat map_x(left.size(), CV_32F), map_y(left.size(), CV_32F), valid(left.size(), CV_32F);
  for (int v = 0; v < left.rows; ++v) {
    const short* d = disparity->ptr<short>(v);
    float *x = map_x.ptr<float>(v), *y = map_y.ptr<float>(v), *known = valid.ptr<float>(v);
    for (int u = 0; u < left.cols; ++u) {
      x[u] = static_cast<float>(u) - static_cast<float>(std::max<short>(d[u], 0)) / 16.f;
      y[u] = static_cast<float>(v);
      known[u] = d[u] > 0 ? 1.f : 0.f;
    }
  }
  cv::Mat warped, left_values, right_values, gradient, warped_gradient;
  left.convertTo(left_values, CV_32F);
  right.convertTo(right_values, CV_32F);
  cv::Sobel(right_values, gradient, CV_32F, 1, 0, 3, 1.0 / 8);
  cv::remap(right_values, warped, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::remap(gradient, warped_gradient, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  warped_gradient = warped_gradient.mul(valid);

  cv::Mat numerator, denominator;
  const cv::Size box(window, window);
  cv::boxFilter(warped_gradient.mul(left_values - warped), numerator, CV_32F, box);
  cv::boxFilter(warped_gradient.mul(warped_gradient), denominator, CV_32F, box);
  for (int v = 0; v < left.rows; ++v) {
    short* d = disparity->ptr<short>(v);
    const float *n = numerator.ptr<float>(v), *g = denominator.ptr<float>(v);
    for (int u = 0; u < left.cols; ++u) {
      if (d[u] <= 0 || g[u] < kMinGradient) continue;
      const float step = -n[u] / g[u];
      if (std::abs(step) < kLargestStep) d[u] = static_cast<short>(std::lround(static_cast<float>(d[u]) + 16.f * step));
    }
  }
}

}  // namespace vip_slam
