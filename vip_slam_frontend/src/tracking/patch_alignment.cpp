// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/patch_alignment.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <opencv2/imgproc.hpp>

namespace vip_slam {

namespace {

constexpr double kConverged = 0.01;  // px
// The camera's own blur, one sigma in px. A patch that is enlarged by the warp has an enlarged blur too; the newest
// image is blurred to match.
constexpr double kBlurOfCamera = 0.55;

template <int side>
struct Patch {
  using Values = Eigen::Matrix<float, side * side, 1>;

  float framed[(side + 2) * (side + 2)];  ///< one more on each side for the gradients
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

template <int side>
bool Patch<side>::sample(const cv::Mat& image, const Eigen::Vector2d& pixel, const PatchWarp& warp) {
  float* out = framed;
  float u[side + 2], v[side + 2];
  const auto right = static_cast<float>(image.cols - 1), bottom = static_cast<float>(image.rows - 1);
  for (int y = 0; y < side + 2; ++y) {
    const double dy = y - side / 2 - 1;
    const Eigen::Vector2d begin = pixel + warp(0, dy), slope = warp.A.col(0) + warp.xy * dy, bend = 0.5 * warp.xx;
    for (int x = 0; x < side + 2; ++x) {
      const double dx = x - side / 2 - 1;
      u[x] = static_cast<float>(begin.x() + (slope.x() + bend.x() * dx) * dx);
      v[x] = static_cast<float>(begin.y() + (slope.y() + bend.y() * dx) * dx);
    }
    // A double just inside may round to the last column or row, which has no neighbour to interpolate with.
    bool inside = true;
    for (int x = 0; x < side + 2; ++x) inside &= (u[x] >= 0) & (v[x] >= 0) & (u[x] < right) & (v[x] < bottom);
    if (!inside) return false;
    for (int x = 0; x < side + 2; ++x) *out++ = bilinear(image, u[x], v[x]);
  }
  return true;
}

template <int side>
Eigen::Matrix3d Patch<side>::gradients() {
  const int row = side + 2;
  for (int y = 0; y < side; ++y) {
    const float* p = framed + (y + 1) * row + 1;
    for (int x = 0; x < side; ++x) {
      const int i = y * side + x;
      grey[i] = p[x];
      gx[i] = 0.5f * (p[x + 1] - p[x - 1]);
      gy[i] = 0.5f * (p[x + row] - p[x - row]);
    }
  }
  Eigen::Matrix3d A;
  A << gx.squaredNorm(), gx.dot(gy), gx.sum(), 0, gy.squaredNorm(), gy.sum(), 0, 0, side * side;
  return A.selfadjointView<Eigen::Upper>();
}

/// Information on the position after eliminating the brightness offset (Schur complement).
Eigen::Matrix2d textureOf(const Eigen::Matrix3d& A) {
  return A.topLeftCorner<2, 2>() - A.topRightCorner<2, 1>() * A.topRightCorner<2, 1>().transpose() / A(2, 2);
}

template <int radius>
Eigen::Matrix2d texture(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  Patch<2 * radius + 1> patch;
  return patch.sample(image, pixel, PatchWarp()) ? textureOf(patch.gradients()) : Eigen::Matrix2d::Zero();
}

/// Part of the newest image, its first element at `origin`.
struct Window {
  cv::Mat grey;  ///< 8U or 32F
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
};

/// The image around the patch, blurred like the enlarged reference patch, or the unchanged image when that blur stays
/// within a pixel. A margin as wide as a narrow patch is for the patch's motion.
Window matchBlur(const cv::Mat& image, const Eigen::Vector2d& pixel, const PatchWarp& warp, int radius) {
  const Eigen::Matrix2d A = warp.A.inverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(A * A.transpose());
  const Eigen::Vector2d added = (solver.eigenvalues().array() - 1.0).max(0.0);
  const Eigen::Matrix2d covariance = solver.eigenvectors() * added.asDiagonal() * solver.eigenvectors().transpose();
  const double sx = kBlurOfCamera * std::sqrt(covariance(0, 0)), sy = kBlurOfCamera * std::sqrt(covariance(1, 1));
  const auto size = [](double sigma) { return 2 * static_cast<int>(std::lround(2.5 * sigma)) + 1; };
  if (size(std::max(sx, sy)) == 1) return {image, Eigen::Vector2d::Zero()};
  const int reach = radius + kNarrowPatch, side = 2 * reach + 1;
  const cv::Rect rect = cv::Rect(static_cast<int>(pixel.x()) - reach, static_cast<int>(pixel.y()) - reach, side, side) &
                        cv::Rect(0, 0, image.cols, image.rows);
  if (rect.empty()) return {image, Eigen::Vector2d::Zero()};
  Window window{cv::Mat(), Eigen::Vector2d(rect.x, rect.y)};
  cv::Mat cut;
  image(rect).convertTo(cut, CV_32F);
  cv::sepFilter2D(cut, window.grey, CV_32F, cv::getGaussianKernel(size(sx), std::max(sx, 0.01), CV_32F),
                  cv::getGaussianKernel(size(sy), std::max(sy, 0.01), CV_32F), cv::Point(-1, -1), 0,
                  cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
  return window;
}

template <int n>
float rootMeanSquare(const Eigen::Matrix<float, n, 1>& values) {
  return std::sqrt(std::max(1e-6f, values.squaredNorm() / n));
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

template <int radius>
PatchAlignment align(const cv::Mat& reference, const Eigen::Vector2d& reference_pixel, const PatchWarp& warp,
                     const cv::Mat& current, const Eigen::Vector2d& start) {
  constexpr int side = 2 * radius + 1;
  using Values = typename Patch<side>::Values;
  PatchAlignment result;
  Patch<side> patch;
  if (!patch.sample(reference, reference_pixel, warp)) return result;
  const Eigen::Matrix3d A = patch.gradients();
  result.texture = textureOf(A);
  const float mean = patch.grey.mean();
  const Values centred = patch.grey.array() - mean;
  const float deviation = rootMeanSquare(centred);
  const Eigen::LDLT<Eigen::Matrix3d> solver(A);
  if (deviation < 1.0f || solver.vectorD().minCoeff() < 1.0) return result;

  const Window window = matchBlur(current, start, warp, radius);
  const bool bytes = window.grey.depth() == CV_8U;
  Eigen::Vector2d pixel = start;
  Values seen;
  double last = std::numeric_limits<double>::infinity();
  while (true) {
    const Eigen::Vector2d first = pixel - window.origin - Eigen::Vector2d::Constant(radius);
    if (!(bytes ? shifted<std::uint8_t, side>(window.grey, first.x(), first.y(), seen.data())
                : shifted<float, side>(window.grey, first.x(), first.y(), seen.data())))
      return result;
    const float seen_mean = seen.mean();
    seen.array() -= seen_mean;
    // A gain for contrast changes by exposure, limited so that noise is not amplified.
    seen = std::clamp(deviation / rootMeanSquare(seen), 0.5f, 2.0f) * seen - centred;
    result.residual = rootMeanSquare(seen);
    const Eigen::Vector3d step = solver.solve(Eigen::Vector3d(patch.gx.dot(seen), patch.gy.dot(seen), seen.sum()));
    const double length = step.head<2>().norm();
    if (!(length < last)) return result;  // diverges; also NaN
    last = length;
    pixel -= step.head<2>();
    if (length < kConverged) {
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
