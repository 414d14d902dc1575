// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/depth/depth_image.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace vip_slam {
namespace {

constexpr int kRadius = 2;  // half window, px
constexpr int kSide = 2 * kRadius + 1;
// A spread of the window's depths above kEdgeRatio * z + kEdgeSigmas * sigma(z) is an edge: 3 % over four
// pixels is a surface seen at 75 degrees (focal length 500 px), six sigmas are beyond the extremes of 25 noisy
// readings.
constexpr double kEdgeRatio = 0.03, kEdgeSigmas = 6.0;
constexpr double kMinValid = 0.6;  // share of the window's pixels that need a reading

// The valid readings of the window around one pixel, gathered in one pass.
struct Window {
  int count = 0;
  float low, high;
  float z[kSide * kSide];  ///< depths, later their inverses
  signed char x[kSide * kSide], y[kSide * kSide];
};

void gather(const cv::Mat& depth, int cu, int cv, const DepthNoise& noise, Window* w) {
  const float min_range = float(noise.min_range), max_range = float(noise.max_range);
  const int x0 = std::max(-kRadius, -cu), x1 = std::min(kRadius, depth.cols - 1 - cu);
  const int y0 = std::max(-kRadius, -cv), y1 = std::min(kRadius, depth.rows - 1 - cv);
  w->low = max_range;
  w->high = 0;
  for (int y = y0; y <= y1; ++y) {
    const float* row = depth.ptr<float>(cv + y) + cu;
    for (int x = x0; x <= x1; ++x) {
      const float z = row[x];
      if (!(z > 0 && z >= min_range && z <= max_range)) continue;  // also refuses NaN
      w->z[w->count] = z;
      w->x[w->count] = static_cast<signed char>(x);
      w->y[w->count++] = static_cast<signed char>(y);
      w->low = std::min(w->low, z);
      w->high = std::max(w->high, z);
    }
  }
}

// Slope of the window's values by least squares; zero when the valid pixels do not span it.
void fitSlope(const Window& w, float mean, float* slope_x, float* slope_y) {
  float sx = 0, sy = 0, sxx = 0, syy = 0, sxy = 0, sxz = 0, syz = 0;
  for (int i = 0; i < w.count; ++i) {
    const float x = w.x[i], y = w.y[i], z = w.z[i] - mean;
    sx += x, sy += y, sxx += x * x, syy += y * y, sxy += x * y, sxz += x * z, syz += y * z;
  }
  const float n = float(w.count);
  sxx -= sx * sx / n, syy -= sy * sy / n, sxy -= sx * sy / n;
  const float determinant = sxx * syy - sxy * sxy;
  if (determinant < 1e-3f * n * n) {
    *slope_x = *slope_y = 0;
    return;
  }
  *slope_x = (syy * sxz - sxy * syz) / determinant;
  *slope_y = (sxx * syz - sxy * sxz) / determinant;
}

bool isEdge(float low, float high, const DepthNoise& noise) {
  const float middle = 0.5f * (low + high);
  return high - low > kEdgeRatio * middle + kEdgeSigmas * noise.sigma(middle);
}

// On a plane the inverse of z is linear over the image, z itself is not: a linear fit to the z of a corridor's wall
// would be too far by some 0.02 % at five metres, and the corridor too long.

// Whether inverse depths without their local slope have more than noise; `low` and `high`: their extremes. Beyond
// kSteepest no surface can be measured.
bool isEdgeOnSlope(float low, float high, float slope_x, float slope_y, const DepthNoise& noise) {
  constexpr float kSteepest = 0.02f;  // relative rise per pixel: about 84 degrees for a focal length of 500 px
  const float z = 2.0f / (low + high);
  return !((slope_x * slope_x + slope_y * slope_y) * z * z <= kSteepest * kSteepest) ||
         (high - low) * z * z > float(kEdgeSigmas * noise.sigma(z));
}

// Without a branch: a median of 25 takes 0.12 us, with std::nth_element 0.32.
inline void order(float& a, float& b) {
  const float low = std::min(a, b);
  b = std::max(a, b);
  a = low;
}

// The median of z's N values and the N - 3 at `next`: the lowest and the highest of more than half of all values are
// not the median, and are forgotten for one that has not been looked at.
template <int N>
float medianByForgetting(float* z, const float* next) {
  for (int i = 0; i < N / 2; ++i) order(z[i], z[N - 1 - i]);
  for (int i = 1; i < (N + 1) / 2; ++i) order(z[0], z[i]);
  for (int i = N / 2; i < N - 1; ++i) order(z[i], z[N - 1]);
  if constexpr (N == 3) {
    return z[1];
  } else {
    z[0] = *next;
    return medianByForgetting<N - 1>(z, next + 1);
  }
}

// The common case, a full 5x5 window of valid pixels: the sums of the slope fit are constants and there are no branches
// per pixel. False when some pixel is invalid: use the general case then.
bool lookUpFull5x5(const cv::Mat& depth, int cu, int cv, float du, float dv, const DepthNoise& noise, bool grazing,
                   float* result) {
  float z[25];
  const float* at = depth.ptr<float>(cv - 2) + cu - 2;
  const std::size_t step = depth.step1();
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 5; ++x) z[5 * y + x] = at[y * step + x];
  }
  float low = z[0], high = z[0], sum = 0, slope_x = 0, slope_y = 0;
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 5; ++x) {
      const float value = z[5 * y + x];
      low = value < low ? value : low;
      high = value > high ? value : high;
      sum += value;
    }
  }
  // Comparisons miss NaN, the sum does not.
  if (!(sum == sum && low > 0 && low >= float(noise.min_range) && high <= float(noise.max_range))) return false;
  const bool edge = isEdge(low, high, noise);
  if (edge && !grazing) {
    *result = 0.0f;
    return true;
  }
  for (float& value : z) value = 1.0f / value;
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 5; ++x) {
      slope_x += float(x - 2) * z[5 * y + x];
      slope_y += float(y - 2) * z[5 * y + x];
    }
  }
  slope_x /= 50.0f;  // sum of x^2 over the window
  slope_y /= 50.0f;
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 5; ++x) z[5 * y + x] += slope_x * (du - float(x - 2)) + slope_y * (dv - float(y - 2));
  }
  if (edge) {
    const auto [lowest, highest] = std::minmax_element(z, z + 25);
    if (isEdgeOnSlope(*lowest, *highest, slope_x, slope_y, noise)) {
      *result = 0.0f;
      return true;
    }
  }
  *result = 1.0f / medianByForgetting<14>(z, z + 14);
  return true;
}

// With `grazing`, windows with a large spread are tested again without the local slope: floors and table tops at a
// grazing angle vary by more than an edge over the window, but are surfaces.
float lookUp(const cv::Mat& depth, double u, double v, const DepthNoise& noise, bool grazing) {
  if (!(u > -1 && v > -1 && u < depth.cols && v < depth.rows)) return 0.0f;
  const int cu = static_cast<int>(std::floor(u + 0.5)), cv = static_cast<int>(std::floor(v + 0.5));
  if (cu < 0 || cv < 0 || cu >= depth.cols || cv >= depth.rows) return 0.0f;
  if (cu >= 2 && cv >= 2 && cu + 2 < depth.cols && cv + 2 < depth.rows) {
    float result;
    if (lookUpFull5x5(depth, cu, cv, float(u - cu), float(v - cv), noise, grazing, &result)) return result;
  }
  Window w;
  gather(depth, cu, cv, noise, &w);
  const int inside = (std::min(cu + kRadius, depth.cols - 1) - std::max(cu - kRadius, 0) + 1) *
                     (std::min(cv + kRadius, depth.rows - 1) - std::max(cv - kRadius, 0) + 1);
  if (w.count == 0 || w.count < kMinValid * std::min(inside, kSide * kSide)) return 0.0f;
  const bool edge = isEdge(w.low, w.high, noise);
  if (edge && !grazing) return 0.0f;

  // The median of the inverse depths extrapolated along the local slope to (u, v): robust, and unbiased on slanted
  // surfaces.
  float mean = 0;
  for (int i = 0; i < w.count; ++i) {
    w.z[i] = 1.0f / w.z[i];
    mean += w.z[i];
  }
  mean /= float(w.count);
  float slope_x, slope_y;
  fitSlope(w, mean, &slope_x, &slope_y);
  const float du = float(u - cu), dv = float(v - cv);
  for (int i = 0; i < w.count; ++i) w.z[i] += slope_x * (du - w.x[i]) + slope_y * (dv - w.y[i]);
  if (edge) {
    const auto [lowest, highest] = std::minmax_element(w.z, w.z + w.count);
    if (isEdgeOnSlope(*lowest, *highest, slope_x, slope_y, noise)) return 0.0f;
  }
  float* median = w.z + w.count / 2;
  std::nth_element(w.z, median, w.z + w.count);
  if (w.count % 2 == 1) return 1.0f / *median;
  return 2.0f / (*median + *std::max_element(w.z, median));
}

void addOffset(double offset, cv::Mat* metres) {
  if (offset == 0) return;
  const auto added = static_cast<float>(offset);
  for (int r = 0; r < metres->rows; ++r) {
    auto* z = metres->ptr<float>(r);
    for (int c = 0; c < metres->cols; ++c) z[c] = z[c] > 0 ? std::max(0.0f, z[c] + added) : 0.0f;
  }
}

void requireFloatDepth(const cv::Mat& depth) {
  if (depth.type() != CV_32FC1) {
    throw std::invalid_argument("depth image: type " + cv::typeToString(depth.type()) +
                                ", expected CV_32FC1 in metres");
  }
}

}  // namespace

float safeDepth(const cv::Mat& depth, double u, double v, const DepthNoise& noise) {
  if (depth.empty()) return 0.0f;
  requireFloatDepth(depth);
  return lookUp(depth, u, v, noise, false);
}

cv::Mat depthToMetres(const cv::Mat& raw, double scale, double offset) {
  if (raw.type() == CV_16UC1) {
    cv::Mat metres;
    raw.convertTo(metres, CV_32F, scale);
    addOffset(offset, &metres);
    return metres;
  }
  if (raw.type() == CV_32FC1) {
    cv::Mat metres(raw.size(), CV_32FC1);
    for (int r = 0; r < raw.rows; ++r) {
      const float* in = raw.ptr<float>(r);
      float* out = metres.ptr<float>(r);
      for (int c = 0; c < raw.cols; ++c) {
        out[c] = (in[c] > 0.0f && in[c] < std::numeric_limits<float>::max()) ? in[c] : 0.0f;
      }
    }
    addOffset(offset, &metres);
    return metres;
  }
  throw std::invalid_argument("depth image: OpenCV type " + cv::typeToString(raw.type()) +
                              ", expected CV_16UC1 or CV_32FC1");
}

DepthGrid makeDepthGrid(const cv::Mat& depth, int stride, const DepthNoise& noise) {
  DepthGrid grid;
  if (depth.empty()) return grid;
  requireFloatDepth(depth);
  if (stride < 1) throw std::invalid_argument("depth grid: stride " + std::to_string(stride) + ", expected >= 1");
  grid.stride = stride;
  grid.offset = stride / 2;
  grid.cols = std::max(0, (depth.cols - 1 - grid.offset) / stride + 1);
  grid.rows = std::max(0, (depth.rows - 1 - grid.offset) / stride + 1);
  grid.z.resize(static_cast<std::size_t>(grid.cols) * grid.rows);
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      grid.z[static_cast<std::size_t>(r) * grid.cols + c] =
          lookUp(depth, grid.offset + c * stride, grid.offset + r * stride, noise, true);
    }
  }
  return grid;
}

}  // namespace vip_slam
