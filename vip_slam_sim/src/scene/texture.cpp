#include "vip_slam_sim/scene/texture.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include <opencv2/imgproc.hpp>

namespace vip_slam {
namespace {

using U16x4 = std::uint16_t __attribute__((vector_size(8)));

constexpr float kFromTexel = 1.f / 65535.f;
constexpr int kMaxProbes = 8;

bool powerOfTwo(int v) { return v > 0 && (v & (v - 1)) == 0; }

inline Vec4 load(const std::uint16_t* p) {
  U16x4 raw;
  std::memcpy(&raw, p, sizeof raw);
  return __builtin_convertvector(raw, Vec4);
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
    throw std::invalid_argument("texture: image must be 8UC3 or 32FC3 and not empty");
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
  levels_.push_back({image.cols, image.rows, texels_.size()});
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const cv::Vec3f c = image.at<cv::Vec3f>(y, x);
      for (int k = 0; k < 3; ++k)
        texels_.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(c[k], 0.f, 1.f) * 65535.f)));
      texels_.push_back(65535);
    }
}

inline Vec4 Texture::bilinear(const Level& level, float s, float t) const {
  s -= 0.5f;
  t -= 0.5f;
  int x0 = floorInt(s), y0 = floorInt(t);
  const float fx = s - static_cast<float>(x0), fy = t - static_cast<float>(y0);
  int x1 = x0 + 1, y1 = y0 + 1;
  if (repeat_) {
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
  const std::uint16_t* row0 = base + static_cast<std::size_t>(y0) * level.width * 4;
  const std::uint16_t* row1 = base + static_cast<std::size_t>(y1) * level.width * 4;
  const Vec4 a = load(row0 + x0 * 4), b = load(row0 + x1 * 4), c = load(row1 + x0 * 4), d = load(row1 + x1 * 4);
  const Vec4 top = a + (b - a) * splat(fx), bottom = c + (d - c) * splat(fx);
  return (top + (bottom - top) * splat(fy)) * splat(kFromTexel);
}

Vec4 Texture::sample(float s, float t, float dsdx, float dtdx, float dsdy, float dtdy) const {
  float major_s = dsdx, major_t = dtdx;
  float major2 = dsdx * dsdx + dtdx * dtdx, minor2 = dsdy * dsdy + dtdy * dtdy;
  if (minor2 > major2) {
    std::swap(major2, minor2);
    major_s = dsdy;
    major_t = dtdy;
  }
  const float major = std::sqrt(major2), minor = std::max(std::sqrt(minor2), major * (1.f / kMaxProbes));
  const int probes = major <= 1.f ? 1 : std::clamp(static_cast<int>(major / minor + 0.5f), 1, kMaxProbes);
  const float lod = minor <= 1.f ? 0.f : fastLog2(minor);
  const int last = static_cast<int>(levels_.size()) - 1;
  const int l0 = std::min(static_cast<int>(lod), last), l1 = std::min(l0 + 1, last);
  const float f = std::min(lod - static_cast<float>(l0), 1.f);
  const Level& a = levels_[l0];
  const Level& b = levels_[l1];
  const float ax = static_cast<float>(a.width) / width(), ay = static_cast<float>(a.height) / height();
  const float bx = static_cast<float>(b.width) / width(), by = static_cast<float>(b.height) / height();
  Vec4 sum = splat(0.f);
  const float step = 1.f / static_cast<float>(probes);
  for (int k = 0; k < probes; ++k) {
    const float o = (static_cast<float>(k) + 0.5f) * step - 0.5f;
    const float ps = s + o * major_s, pt = t + o * major_t;
    Vec4 c = bilinear(a, ps * ax, pt * ay);
    if (f > 0.02f && l1 != l0) c += (bilinear(b, ps * bx, pt * by) - c) * splat(f);
    sum += c;
  }
  return sum * splat(step);
}

}  // namespace vip_slam
