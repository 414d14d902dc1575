// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/shared_depth_error.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace vip_slam {
namespace {

constexpr float kSlant = 0.5f;     ///< growth of a surface's error with 1/cos of the angle of incidence
constexpr float kMostSlant = 3.f;  ///< 1/cos - 1 counts up to here
constexpr int kStride = 4;         ///< px; fields are read at this distance and blended

}  // namespace

SharedDepthError::SharedDepthError(const DepthOptions& options, int seed)
    : options_(options),
      surface_(static_cast<std::uint64_t>(seed) * 2654435761ull + 17),
      warp_(surface_.other(1)),
      fixed_(surface_.other(2)) {}

bool SharedDepthError::none() const {
  return options_.scale == 1 && options_.offset == 0 && options_.surface_error == 0 && options_.warp == 0 &&
         options_.fixed_warp == 0;
}

cv::Mat SharedDepthError::apply(const FrameBuffers& frame, const Scene& scene, double t) const {
  const int w = frame.depth.cols, h = frame.depth.rows;
  const auto when = static_cast<float>(t / options_.shared_time);
  const auto per_px = static_cast<float>(1 / options_.shared_px);
  const auto of_surface = static_cast<float>(options_.surface_error);
  const auto of_warp = static_cast<float>(options_.warp), of_fixed = static_cast<float>(options_.fixed_warp);
  cv::Mat coarse(h / kStride + 2, w / kStride + 2, CV_32FC1);
  for (int y = 0; y < coarse.rows; ++y)
    for (int x = 0; x < coarse.cols; ++x) {
      const float u = static_cast<float>(x * kStride) * per_px, v = static_cast<float>(y * kStride) * per_px;
      coarse.at<float>(y, x) = of_warp * warp_(u, v, when) + of_fixed * fixed_(u, v, 0.f);
    }
  std::unordered_map<int, float> errors;  // of the surfaces in this image
  const auto errorOf = [&](int surface) {
    const auto [it, fresh] = errors.emplace(surface, 0.f);
    if (fresh) it->second = of_surface * surface_.other(static_cast<std::uint64_t>(surface + 8))(when);
    return it->second;
  };
  const auto a = static_cast<float>(options_.a), b = static_cast<float>(options_.b), c = static_cast<float>(options_.c);
  const auto scale = static_cast<float>(options_.scale), offset = static_cast<float>(options_.offset);
  cv::Mat out(h, w, CV_32FC1);
  for (int v = 0; v < h; ++v) {
    const float* in = frame.depth.ptr<float>(v);
    const int* piece = frame.piece.ptr<int>(v);
    const float* cosine = frame.grazing.ptr<float>(v);
    const float* top = coarse.ptr<float>(v / kStride);
    const float* bottom = coarse.ptr<float>(v / kStride + 1);
    const float fv = static_cast<float>(v % kStride) / kStride;
    auto* to = out.ptr<float>(v);
    int last_piece = -2;
    float error = 0;
    for (int u = 0; u < w; ++u) {
      const float z = in[u];
      if (z <= 0) {
        to[u] = 0;
        continue;
      }
      if (piece[u] != last_piece) {
        last_piece = piece[u];
        error = errorOf(last_piece < 0 ? -2 : scene.surfaceOf(last_piece));
      }
      const float slant = std::min(1.f / std::max(cosine[u], 0.05f) - 1.f, kMostSlant);
      const float fu = static_cast<float>(u % kStride) / kStride;
      const int x = u / kStride;
      const float upper = top[x] + (top[x + 1] - top[x]) * fu, lower = bottom[x] + (bottom[x + 1] - bottom[x]) * fu;
      const float sigma = a + (b + c * z) * z;
      to[u] = scale * z + offset + sigma * (error * (1 + kSlant * slant) + upper + (lower - upper) * fv);
    }
  }
  return out;
}

}  // namespace vip_slam
