// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/patch_alignment.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <opencv2/imgproc.hpp>

namespace vip_slam {

namespace {

constexpr int kIterations = 12;
constexpr double kFarthestStep = 3.0, kConverged = 0.01;  // px
// The camera's own blur, one sigma in px. A patch that is enlarged by the warp has an enlarged blur too; the newest
// image is blurred to match when that takes at least kMinBlur, px.
constexpr double kBlurOfCamera = 0.55, kMinBlur = 0.3;
constexpr int kBlurReach = 5;  // px, margin of the blurred window that the patch may move within

template <int kRadius>
struct Patch {
  static constexpr int kSide = 2 * kRadius + 1;
  static constexpr int kRow = kSide + 2;  // one more on each side for the gradients
  static constexpr int kCount = kSide * kSide;
  using Values = Eigen::Matrix<float, kCount, 1>;

  float framed[kRow * kRow];
  Values grey, gx, gy;

  /// Samples the patch with its margin; false outside the image.
  bool sample(const cv::Mat& image, const Eigen::Vector2d& pixel, const PatchWarp& warp);
  /// Gradients; returns the sums of products of (g_x, g_y, 1).
  Eigen::Matrix3d gradients();
};

inline float bilinear(const cv::Mat& image, float x, float y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float fx = x - ix, fy = y - iy;
  const std::uint8_t* p = image.ptr<std::uint8_t>(iy) + ix;
  const std::uint8_t* q = p + image.step[0];
  return (1 - fy) * ((1 - fx) * p[0] + fx * p[1]) + fy * ((1 - fx) * q[0] + fx * q[1]);
}

template <int kRadius>
bool Patch<kRadius>::sample(const cv::Mat& image, const Eigen::Vector2d& pixel, const PatchWarp& warp) {
  for (int y = 0; y < kRow; ++y) {
    const double dy = y - kRadius - 1;
    const Eigen::Vector2d begin = pixel + warp(0, dy), slope = warp.A.col(0) + warp.xy * dy, bend = 0.5 * warp.xx;
    for (int x = 0; x < kRow; ++x) {
      const double dx = x - kRadius - 1;
      const Eigen::Vector2d p = begin + (slope + bend * dx) * dx;
      const auto u = static_cast<float>(p.x()), v = static_cast<float>(p.y());
      // A double just inside may round to the last column or row, which has no neighbour to interpolate with.
      if (!(u >= 0) || !(v >= 0) || u >= static_cast<float>(image.cols - 1) || v >= static_cast<float>(image.rows - 1))
        return false;
      framed[y * kRow + x] = bilinear(image, u, v);
    }
  }
  return true;
}

template <int kRadius>
Eigen::Matrix3d Patch<kRadius>::gradients() {
  for (int y = 0; y < kSide; ++y) {
    const float* p = framed + (y + 1) * kRow + 1;
    for (int x = 0; x < kSide; ++x) {
      const int i = y * kSide + x;
      grey[i] = p[x];
      gx[i] = 0.5f * (p[x + 1] - p[x - 1]);
      gy[i] = 0.5f * (p[x + kRow] - p[x - kRow]);
    }
  }
  Eigen::Matrix3d A;
  A << gx.squaredNorm(), gx.dot(gy), gx.sum(), 0, gy.squaredNorm(), gy.sum(), 0, 0, kCount;
  return A.selfadjointView<Eigen::Upper>();
}

/// Information on the position after eliminating the brightness offset (Schur complement).
Eigen::Matrix2d textureOf(const Eigen::Matrix3d& A) {
  return A.topLeftCorner<2, 2>() - A.topRightCorner<2, 1>() * A.topRightCorner<2, 1>().transpose() / A(2, 2);
}

template <int kRadius>
Eigen::Matrix2d texture(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  Patch<kRadius> patch;
  return patch.sample(image, pixel, PatchWarp()) ? textureOf(patch.gradients()) : Eigen::Matrix2d::Zero();
}

/// Part of the newest image, its first element at `origin`.
struct Window {
  cv::Mat grey;  ///< 8U or 32F
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
};

/// The image around the patch, blurred like the enlarged reference patch, or the unchanged image when that is little.
Window matchBlur(const cv::Mat& image, const Eigen::Vector2d& pixel, const PatchWarp& warp, int radius) {
  const Eigen::Matrix2d A = warp.A.inverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(A * A.transpose());
  const Eigen::Vector2d added = (solver.eigenvalues().array() - 1.0).max(0.0);
  const Eigen::Matrix2d covariance = solver.eigenvectors() * added.asDiagonal() * solver.eigenvectors().transpose();
  const double sx = kBlurOfCamera * std::sqrt(covariance(0, 0)), sy = kBlurOfCamera * std::sqrt(covariance(1, 1));
  if (!(std::max(sx, sy) > kMinBlur)) return {image, Eigen::Vector2d::Zero()};
  const int reach = radius + kBlurReach, side = 2 * reach + 1;
  const cv::Rect rect = cv::Rect(static_cast<int>(pixel.x()) - reach, static_cast<int>(pixel.y()) - reach, side, side) &
                        cv::Rect(0, 0, image.cols, image.rows);
  if (rect.empty()) return {image, Eigen::Vector2d::Zero()};
  Window window{cv::Mat(), Eigen::Vector2d(rect.x, rect.y)};
  cv::Mat cut;
  image(rect).convertTo(cut, CV_32F);
  const auto size = [](double sigma) { return 2 * static_cast<int>(std::ceil(2.5 * sigma)) + 1; };
  cv::sepFilter2D(cut, window.grey, CV_32F, cv::getGaussianKernel(size(sx), std::max(sx, 0.01), CV_32F),
                  cv::getGaussianKernel(size(sy), std::max(sy, 0.01), CV_32F), cv::Point(-1, -1), 0,
                  cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
  return window;
}

/// The square of `side` pixels whose first lies at (x, y); false outside.
template <typename Grey, int side>
bool shifted(const cv::Mat& image, double x, double y, float* out) {
  if (!(x >= 0) || !(y >= 0) || x + side >= image.cols || y + side >= image.rows) return false;
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float fx = static_cast<float>(x - ix), fy = static_cast<float>(y - iy);
  const float w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
  for (int v = 0; v < side; ++v) {
    const Grey* p = image.ptr<Grey>(iy + v) + ix;
    const Grey* q = image.ptr<Grey>(iy + v + 1) + ix;
    for (int u = 0; u < side; ++u) out[v * side + u] = w00 * p[u] + w01 * p[u + 1] + w10 * q[u] + w11 * q[u + 1];
  }
  return true;
}

template <int kRadius>
PatchAlignment align(const cv::Mat& reference, const Eigen::Vector2d& reference_pixel, const PatchWarp& warp,
                     const cv::Mat& current, const Eigen::Vector2d& start) {
  using Square = Patch<kRadius>;
  PatchAlignment result;
  Square patch;
  if (!patch.sample(reference, reference_pixel, warp)) return result;
  const Eigen::Matrix3d A = patch.gradients();
  result.texture = textureOf(A);
  const float mean = patch.grey.mean();
  const float deviation =
      std::sqrt(std::max(1e-6f, (patch.grey.array() - mean).matrix().squaredNorm() / Square::kCount));
  const Eigen::LDLT<Eigen::Matrix3d> solver(A);
  if (deviation < 1.0f || solver.vectorD().minCoeff() < 1.0) return result;

  const Window window = matchBlur(current, start, warp, kRadius);
  const bool bytes = window.grey.depth() == CV_8U;
  Eigen::Vector2d pixel = start;
  typename Square::Values seen;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Eigen::Vector2d first = pixel - window.origin - Eigen::Vector2d::Constant(kRadius);
    if (!(bytes ? shifted<std::uint8_t, Square::kSide>(window.grey, first.x(), first.y(), seen.data())
                : shifted<float, Square::kSide>(window.grey, first.x(), first.y(), seen.data())))
      return result;
    const float seen_mean = seen.mean();
    seen.array() -= seen_mean;
    // A gain for contrast changes by exposure, limited so that noise is not amplified.
    const float gain =
        std::clamp(deviation / std::sqrt(std::max(1e-6f, seen.squaredNorm() / Square::kCount)), 0.5f, 2.0f);
    seen = gain * seen - (patch.grey.array() - mean).matrix();
    result.residual = std::sqrt(seen.squaredNorm() / Square::kCount);
    const Eigen::Vector3d step = solver.solve(Eigen::Vector3d(patch.gx.dot(seen), patch.gy.dot(seen), seen.sum()));
    if (!step.allFinite() || step.head<2>().norm() > kFarthestStep) return result;
    pixel -= step.head<2>();
    if (step.head<2>().squaredNorm() < kConverged * kConverged) {
      // The residual must be small compared with the patch's own contrast, else another patch was found.
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
    PatchAlignment aligned = align<kWidePatch>(reference, reference_pixel, warp, current, start);
    aligned.wide = true;
    if (aligned.ok) return aligned;
  }
  return align<kNarrowPatch>(reference, reference_pixel, warp, current, start);
}

}  // namespace vip_slam
