// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/edge_fattening.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vip_slam {
namespace {

constexpr float kNearer = 0.05f;       ///< nearer by this share of the depth: another surface
constexpr float kPatch = 12.f;         ///< px over which the growth along an edge stays the same
constexpr float kPatchSeconds = 0.1f;  ///< and how long
constexpr float kNothing = 1e6f;

}  // namespace

EdgeFattening::EdgeFattening(int reach, int seed)
    : reach_(reach), uneven_(static_cast<std::uint64_t>(seed) * 40503 + 29) {}

void EdgeFattening::apply(double t, cv::Mat* depth) const {
  if (reach_ <= 0) return;
  cv::Mat filled = depth->clone();
  filled.setTo(kNothing, filled <= 0);
  std::vector<cv::Mat> nearest(reach_ + 1);  // within so many pixels
  nearest[0] = filled;
  for (int r = 1; r <= reach_; ++r)
    cv::erode(nearest[r - 1], nearest[r], cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  const cv::Mat& widest = nearest[reach_];
  const auto when = static_cast<float>(t) / kPatchSeconds;
  for (int v = 0; v < depth->rows; ++v) {
    auto* z = depth->ptr<float>(v);
    const float* own = filled.ptr<float>(v);
    const float* low = widest.ptr<float>(v);
    for (int u = 0; u < depth->cols; ++u) {
      if (low[u] >= kNothing || own[u] - low[u] < kNearer * std::min(own[u], 10.f)) continue;
      const float share = uneven_(static_cast<float>(u) / kPatch, static_cast<float>(v) / kPatch, when);
      const int r =
          std::clamp(static_cast<int>(std::lround((0.65f + 0.25f * share) * static_cast<float>(reach_))), 0, reach_);
      const float grown = nearest[r].at<float>(v, u);
      if (own[u] - grown >= kNearer * std::min(own[u], 10.f)) z[u] = grown;
    }
  }
}

}  // namespace vip_slam
