// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/scene/texture.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include <opencv2/imgproc.hpp>

#include "vip_slam_core/util/size_text.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace vip_slam {
namespace {

#ifndef __SSE2__
using U16x4 = std::uint16_t __attribute__((vector_size(8)));
#endif

constexpr float kFromTexel = 1.f / 65535.f;
constexpr int kMaxProbes = 8;

bool powerOfTwo(int v) { return v > 0 && (v & (v - 1)) == 0; }

inline Vec4 load(const std::uint16_t* p) {
#ifdef __SSE2__
  // Explicit intrinsics, because compilers convert the 16-bit lanes one by one here.
  const __m128i raw = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(p));
  return _mm_cvtepi32_ps(_mm_unpacklo_epi16(raw, _mm_setzero_si128()));
#else
  U16x4 raw;
  std::memcpy(&raw, p, sizeof raw);
  return __builtin_convertvector(raw, Vec4);
#endif
}

/// log2 to about 0.01: enough to choose a mip level.
inline float fastLog2(float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  const float exponent = static_cast<float>(static_cast<int>(bits >> 23) - 127);
  bits = (bits & 0x7FFFFFu) | 0x3F800000u;
  float m;
  std::memcpy(&m, &bits, sizeof m);
  return exponent + (-0.33333333f * m + 2.f) * m - 1.66666666f;
}

inline int floorInt(float x) {
  const int i = static_cast<int>(x);
  return i - (x < static_cast<float>(i));
}

}  // namespace

Texture::Texture(const cv::Mat& image, bool repeat) : repeat_(repeat) {
  if (image.empty() || (image.type() != CV_8UC3 && image.type() != CV_32FC3))
    throw std::invalid_argument("texture: image is " + sizeText(image.size()) + " " + cv::typeToString(image.type()) +
                                ", expected CV_8UC3 or CV_32FC3 that is not empty");
  if (repeat && (!powerOfTwo(image.cols) || !powerOfTwo(image.rows)))
    throw std::invalid_argument("texture: a repeating image needs power-of-two sides, has " +
                                std::to_string(image.cols) + "x" + std::to_string(image.rows));
  cv::Mat level;
  image.convertTo(level, CV_32FC3, image.depth() == CV_8U ? 1.0 / 255 : 1.0);
  addLevel(level);
  while (level.cols > 1 || level.rows > 1) {
    cv::Mat half;
    cv::resize(level, half, cv::Size(std::max(1, level.cols / 2), std::max(1, level.rows / 2)), 0, 0, cv::INTER_AREA);
    level = half;
    addLevel(level);
  }
}

void Texture::addLevel(const cv::Mat& image) {
  const float w0 = levels_.empty() ? 1.f : static_cast<float>(image.cols) / static_cast<float>(width());
  const float h0 = levels_.empty() ? 1.f : static_cast<float>(image.rows) / static_cast<float>(height());
  levels_.push_back({image.cols, image.rows, w0, h0, texels_.size()});
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const cv::Vec3f c = image.at<cv::Vec3f>(y, x);
      for (int k = 0; k < 3; ++k)
        texels_.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(c[k], 0.f, 1.f) * 65535.f)));
      texels_.push_back(65535);
    }
}

template <bool kRepeat>
inline Vec4 Texture::bilinear(const Level& level, float s, float t) const {
  s = s * level.scale_s - 0.5f;
  t = t * level.scale_t - 0.5f;
  int x0 = floorInt(s), y0 = floorInt(t);
  const float fx = s - static_cast<float>(x0), fy = t - static_cast<float>(y0);
  int x1 = x0 + 1, y1 = y0 + 1;
  if (kRepeat) {
    x0 &= level.width - 1;
    x1 &= level.width - 1;
    y0 &= level.height - 1;
    y1 &= level.height - 1;
  } else {
    x0 = std::clamp(x0, 0, level.width - 1);
    x1 = std::clamp(x1, 0, level.width - 1);
    y0 = std::clamp(y0, 0, level.height - 1);
    y1 = std::clamp(y1, 0, level.height - 1);
  }
  const std::uint16_t* base = texels_.data() + level.offset;
  const std::uint16_t* row0 = base + static_cast<std::ptrdiff_t>(y0) * level.width * 4;
  const std::uint16_t* row1 = base + static_cast<std::ptrdiff_t>(y1) * level.width * 4;
  const Vec4 a = load(row0 + x0 * 4), b = load(row0 + x1 * 4), c = load(row1 + x0 * 4), d = load(row1 + x1 * 4);
  const Vec4 top = a + (b - a) * splat(fx), bottom = c + (d - c) * splat(fx);
  return top + (bottom - top) * splat(fy);
}

/// Mean of `probes` look-ups along (ds, dt), between levels a and b.
template <bool kRepeat>
inline Vec4 Texture::probe(const Level& a, const Level& b, float f, float s, float t, float ds, float dt,
                           int probes) const {
  const float step = 1.f / static_cast<float>(probes);
  const bool only_a = f<0.08f, only_b = f> 0.92f;
  Vec4 sum = splat(0.f);
  float o = 0.5f * step - 0.5f;
  for (int k = 0; k < probes; ++k, o += step) {
    const float ps = s + o * ds, pt = t + o * dt;
    if (only_b) {
      sum += bilinear<kRepeat>(b, ps, pt);
    } else {
      Vec4 c = bilinear<kRepeat>(a, ps, pt);
      if (!only_a) c += (bilinear<kRepeat>(b, ps, pt) - c) * splat(f);
      sum += c;
    }
  }
  return sum * splat(step * kFromTexel);
}

Vec4 Texture::sample(float s, float t, float dsdx, float dtdx, float dsdy, float dtdy) const {
  float major_s = dsdx, major_t = dtdx;
  float major2 = dsdx * dsdx + dtdx * dtdx, minor2 = dsdy * dsdy + dtdy * dtdy;
  if (minor2 > major2) {
    std::swap(major2, minor2);
    major_s = dsdy;
    major_t = dtdy;
  }
  minor2 = std::max(minor2, major2 * (1.f / (kMaxProbes * kMaxProbes)));
  int probes = 1;
  if (major2 > 1.f && major2 > 2.25f * minor2) {
    const float ratio = std::sqrt(major2 / std::max(minor2, 1.f));
    probes = std::min(static_cast<int>(ratio + 0.5f), kMaxProbes);
  }
  const float lod = minor2 <= 1.f ? 0.f : 0.5f * fastLog2(minor2);
  const int last = static_cast<int>(levels_.size()) - 1;
  const int l0 = std::min(static_cast<int>(lod), last), l1 = std::min(l0 + 1, last);
  const float f = std::min(lod - static_cast<float>(l0), 1.f);
  return repeat_ ? probe<true>(levels_[l0], levels_[l1], f, s, t, major_s, major_t, probes)
                 : probe<false>(levels_[l0], levels_[l1], f, s, t, major_s, major_t, probes);
}

}  // namespace vip_slam
