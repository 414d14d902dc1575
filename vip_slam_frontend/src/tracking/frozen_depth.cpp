// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/frozen_depth.h"

namespace vip_slam {
namespace {

constexpr int kStep = 12;      // pixels
constexpr int kMinDepth = 50;  // samples with depth; with noise that many are never all equal

}  // namespace

bool FrozenDepth::repeats(const cv::Mat& depth) {
  std::vector<float> now;
  int with_depth = 0;
  for (int y = kStep / 2; y < depth.rows; y += kStep) {
    const float* row = depth.ptr<float>(y);
    for (int x = kStep / 2; x < depth.cols; x += kStep) {
      now.push_back(row[x] > 0 ? row[x] : 0.f);
      with_depth += row[x] > 0;
    }
  }
  const bool same = with_depth >= kMinDepth && now == last_;
  last_ = std::move(now);
  return same;
}

}  // namespace vip_slam
