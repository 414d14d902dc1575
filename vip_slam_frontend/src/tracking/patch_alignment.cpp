#include "vip_slam_frontend/tracking/patch_alignment.h"

#include <cmath>

#include <Eigen/Cholesky>

namespace vip_slam {

namespace {

template <int kRadius>
struct Size {
  static constexpr int kSide = 2 * kRadius + 1;
  static constexpr int kRow = kSide + 2;  // one more on each side for the gradients
  static constexpr int kCount = kSide * kSide;
};

inline float bilinear(const cv::Mat& image, float x, float y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float fx = x - ix, fy = y - iy;
  const std::uint8_t* p = image.ptr<std::uint8_t>(iy) + ix;
  const std::uint8_t* q = p + image.step[0];
  return (1 - fy) * ((1 - fx) * p[0] + fx * p[1]) + fy * ((1 - fx) * q[0] + fx * q[1]);
}

/// Gradients of the inner (kSide x kSide) part; returns the sums of products of (g_x, g_y, 1).
template <int kRadius>
Eigen::Matrix3d gradients(const float* framed, float* patch, float* gx, float* gy) {
  constexpr int kSide = Size<kRadius>::kSide, kRow = Size<kRadius>::kRow;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float* p = framed + (y + 1) * kRow + x + 1;
      const int i = y * kSide + x;
      patch[i] = *p;
      gx[i] = 0.5f * (p[1] - p[-1]);
      gy[i] = 0.5f * (p[kRow] - p[-kRow]);
      const Eigen::Vector3d g(gx[i], gy[i], 1.0);
      A += g * g.transpose();
    }
  }
  return A;
}

/// What the position keeps when the brightness is estimated along.
Eigen::Matrix2d textureOf(const Eigen::Matrix3d& A) {
  return A.topLeftCorner<2, 2>() - A.topRightCorner<2, 1>() * A.topRightCorner<2, 1>().transpose() / A(2, 2);
}

/// Samples the patch with its margin; false outside the image.
template <int kRadius>
bool sample(const cv::Mat& image, const Eigen::Vector2d& pixel, const PatchWarp& warp, float* framed) {
  constexpr int kRow = Size<kRadius>::kRow;
  for (int y = 0; y < kRow; ++y) {
    const double dy = y - kRadius - 1;
    const Eigen::Vector2d begin = pixel + warp(0, dy), slope = warp.A.col(0) + warp.xy * dy, bend = 0.5 * warp.xx;
    for (int x = 0; x < kRow; ++x) {
      const double dx = x - kRadius - 1;
      const Eigen::Vector2d p = begin + (slope + bend * dx) * dx;
      if (!(p.x() >= 0) || !(p.y() >= 0) || p.x() >= image.cols - 1 || p.y() >= image.rows - 1) return false;
      framed[y * kRow + x] = bilinear(image, static_cast<float>(p.x()), static_cast<float>(p.y()));
    }
  }
  return true;
}

template <int kRadius>
Eigen::Matrix2d texture(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  constexpr int kRow = Size<kRadius>::kRow, kCount = Size<kRadius>::kCount;
  float framed[kRow * kRow], patch[kCount], gx[kCount], gy[kCount];
  if (!sample<kRadius>(image, pixel, PatchWarp(), framed)) return Eigen::Matrix2d::Zero();
  return textureOf(gradients<kRadius>(framed, patch, gx, gy));
}

template <int kRadius>
PatchAlignment align(const cv::Mat& reference, const Eigen::Vector2d& reference_pixel, const PatchWarp& warp,
                     const cv::Mat& current, const Eigen::Vector2d& start) {
  constexpr int kSide = Size<kRadius>::kSide, kRow = Size<kRadius>::kRow, kCount = Size<kRadius>::kCount;
  PatchAlignment result;
  float framed[kRow * kRow];
  if (!sample<kRadius>(reference, reference_pixel, warp, framed)) return result;
  float patch[kCount], gx[kCount], gy[kCount];
  const Eigen::Matrix3d A = gradients<kRadius>(framed, patch, gx, gy);
  result.texture = textureOf(A);
  double mean = 0, square = 0;
  for (float value : patch) {
    mean += value;
    square += value * value;
  }
  mean /= kCount;
  const double deviation = std::sqrt(std::max(1e-6, square / kCount - mean * mean));
  const Eigen::LDLT<Eigen::Matrix3d> solver(A);
  if (deviation < 1.0 || solver.vectorD().minCoeff() < 1.0) return result;

  Eigen::Vector2d pixel = start;
  float sampled[kCount];
  for (int iteration = 0; iteration < 12; ++iteration) {
    const double x0 = pixel.x() - kRadius, y0 = pixel.y() - kRadius;
    if (!(x0 >= 0) || !(y0 >= 0) || x0 + kSide >= current.cols || y0 + kSide >= current.rows) return result;
    const int ix = static_cast<int>(x0), iy = static_cast<int>(y0);
    const float fx = static_cast<float>(x0 - ix), fy = static_cast<float>(y0 - iy);
    const float w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
    double sum = 0, sum2 = 0;
    for (int y = 0; y < kSide; ++y) {
      const std::uint8_t* p = current.ptr<std::uint8_t>(iy + y) + ix;
      const std::uint8_t* q = current.ptr<std::uint8_t>(iy + y + 1) + ix;
      for (int x = 0; x < kSide; ++x) {
        const float value = w00 * p[x] + w01 * p[x + 1] + w10 * q[x] + w11 * q[x + 1];
        sampled[y * kSide + x] = value;
        sum += value;
        sum2 += value * value;
      }
    }
    const double sampled_mean = sum / kCount;
    const double sampled_deviation = std::sqrt(std::max(1e-6, sum2 / kCount - sampled_mean * sampled_mean));
    // Exposure may change the contrast; noise must not blow it up.
    const float gain = static_cast<float>(std::min(2.0, std::max(0.5, deviation / sampled_deviation)));
    const float offset = static_cast<float>(mean - gain * sampled_mean);
    double bx = 0, by = 0, bo = 0, cost = 0;
    for (int i = 0; i < kCount; ++i) {
      const float e = gain * sampled[i] + offset - patch[i];
      bx += gx[i] * e;
      by += gy[i] * e;
      bo += e;
      cost += e * e;
    }
    result.residual = std::sqrt(cost / kCount);
    const Eigen::Vector3d step = solver.solve(Eigen::Vector3d(bx, by, bo));
    if (!step.allFinite() || step.head<2>().norm() > 3.0) return result;
    pixel -= step.head<2>();
    if (step.head<2>().squaredNorm() < 1e-4) {
      // What is left over must be small beside the patch's own contrast, else it shows something else.
      result.ok = result.residual < 0.6 * deviation + 2.0;
      break;
    }
  }
  result.pixel = pixel;
  return result;
}

}  // namespace

Eigen::Matrix2d patchTexture(const cv::Mat& image, const Eigen::Vector2d& pixel, bool wide) {
  if (wide) {
    const Eigen::Matrix2d whole = texture<kWidePatch>(image, pixel);
    if (!whole.isZero()) return whole;
  }
  return texture<kNarrowPatch>(image, pixel);
}

PatchAlignment alignPatch(const cv::Mat& reference, const Eigen::Vector2d& reference_pixel, const PatchWarp& warp,
                          const cv::Mat& current, const Eigen::Vector2d& start, bool wide) {
  if (wide) {
    const PatchAlignment aligned = align<kWidePatch>(reference, reference_pixel, warp, current, start);
    if (aligned.ok) return aligned;
  }
  return align<kNarrowPatch>(reference, reference_pixel, warp, current, start);
}

}  // namespace vip_slam
