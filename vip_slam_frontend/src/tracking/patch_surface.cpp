// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/patch_surface.h"

#include <array>
#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

namespace {

constexpr int kStride = 2;
// One sigma of the slope's prior, 1/px. At the flattest angles that can be tracked slopes are a few per cent a pixel;
// the prior matters where readings are few.
constexpr double kPriorSlope = 0.03;

// Of the means of the window's rows and columns: a systematic error as a share of the depth, and the fewest readings.
constexpr double kLineFloor = 0.0003;
constexpr int kFewestOfLine = 3;

/// Sums over the readings in one row or column of the window; `along` is their coordinate in it.
struct Line {
  int count = 0, along = 0, squares = 0;
  double value = 0;

  void add(int a, double v) { ++count, along += a, squares += a * a, value += v; }
  /// Squared deviation of the mean over its variance; `fitted`: sum of what the plane has at the readings.
  double chi2(double fitted, double sigma) const {
    if (count < kFewestOfLine) return 0;
    const double mean = (value - fitted) / count;
    return mean * mean / (sigma * sigma / count + kLineFloor * kLineFloor);
  }
};

/// The plane over the (2 radius + 1)^2 window about the pixel.
template <int radius>
PatchSurface surfaceOver(const cv::Mat& depth_image, const Eigen::Vector2d& pixel, double depth,
                         const DepthNoise& noise) {
  PatchSurface surface;
  surface.depth = depth;
  const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
  if (u < radius || v < radius || u + radius >= depth_image.cols || v + radius >= depth_image.rows) return surface;

  // Least squares on depth / z = offset + slope . d, in units of the noise of one reading.
  const double sigma = std::max(noise.sigma(depth) / depth, 1e-4);
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double square = 0;
  int foreign = 0;
  constexpr int lines = 2 * radius / kStride + 1;
  std::array<Line, lines> rows, columns;
  for (int y = -radius; y <= radius; y += kStride) {
    const float* row = depth_image.ptr<float>(v + y) + u;
    for (int x = -radius; x <= radius; x += kStride) {
      const double z = row[x];
      if (!(z > 0)) continue;  // also NaN
      if (z < 0.5 * depth || z > 2.0 * depth) {
        ++foreign;
        continue;
      }
      const double value = depth / z - 1.0;
      b += Eigen::Vector3d(1.0, x, y) * value;
      square += value * value;
      rows[(y + radius) / kStride].add(x, value);
      columns[(x + radius) / kStride].add(y, value);
    }
  }
  int count = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (int i = 0; i < lines; ++i) {
    const int v_of_row = i * kStride - radius;
    count += rows[i].count;
    x += rows[i].along;
    y += columns[i].along;
    xx += rows[i].squares;
    xy += v_of_row * rows[i].along;
    yy += columns[i].squares;
  }
  if (count < kMinValid * lines * lines || foreign > (1 - kGateProbability) * count) return surface;
  const double prior = sigma * sigma / (kPriorSlope * kPriorSlope);
  Eigen::Matrix3d A;
  A << count, x, y, x, xx + prior, xy, y, xy, yy + prior;
  const Eigen::Vector3d fit = A.ldlt().solve(b);
  const double residual = std::sqrt(std::max(0.0, square - b.dot(fit)) / count);
  // With a step or an edge inside the window the fit is no plane, and its slope would be worse than none.
  if (residual > 2.0 * sigma + 0.002 || !fit.allFinite()) return surface;
  // A step or a bend that single readings hide in their noise shows in the means of rows and columns. On a plane they
  // deviate by less than what a residual may without losing weight.
  double chi2 = 0;
  for (int i = 0; i < lines; ++i) {
    const Line &row = rows[i], &column = columns[i];
    const int at = i * kStride - radius;
    chi2 += row.chi2(row.count * (fit(0) + at * fit(2)) + row.along * fit(1), sigma) +
            column.chi2(column.count * (fit(0) + at * fit(1)) + column.along * fit(2), sigma);
  }
  const int dof = 2 * lines - 4;
  if (chi2 > kHuberSigmas * kHuberSigmas * dof) return surface;
  surface.slope = fit.tail<2>();
  surface.known = true;
  return surface;
}

}  // namespace

PatchSurface patchSurface(const cv::Mat& depth_image, const Eigen::Vector2d& pixel, double depth,
                          const DepthNoise& noise) {
  PatchSurface surface;
  surface.depth = depth;
  if (!(depth > 0) || depth_image.empty()) return surface;
  surface = surfaceOver<kWidePatch>(depth_image, pixel, depth, noise);
  surface.wide = surface.known;
  return surface.wide ? surface : surfaceOver<kNarrowPatch>(depth_image, pixel, depth, noise);
}

PatchSurface narrowPatchSurface(const cv::Mat& depth_image, const Eigen::Vector2d& pixel, double depth,
                                const DepthNoise& noise) {
  if (!(depth > 0) || depth_image.empty()) return {depth};
  return surfaceOver<kNarrowPatch>(depth_image, pixel, depth, noise);
}

bool patchWarp(const RowCamera& reference, const RowCamera& current, const Eigen::Vector2d& reference_pixel,
               const PatchSurface& surface, const SE3& T_cur_ref, PatchWarp* warp_ref_cur) {
  PatchSurface plane = surface;
  if (!(plane.depth > 0)) plane.depth = kFarAway;
  const double h = 3.0;
  // The warp from reference to current and its derivatives by differences over nine points ...
  Eigen::Vector2d seen[3][3];
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x) {
      const Eigen::Vector2d offset(h * (x - 1), h * (y - 1));
      const Eigen::Vector3d p = reference.unproject(reference_pixel + offset, plane.depthAt(offset));
      if (!current.project(T_cur_ref * p, &seen[y][x])) return false;
    }
  }
  Eigen::Matrix2d A_cur_ref;
  A_cur_ref.col(0) = (seen[1][2] - seen[1][0]) / (2 * h);
  A_cur_ref.col(1) = (seen[2][1] - seen[0][1]) / (2 * h);
  const double det = A_cur_ref.determinant();
  if (!(det > 0.05) || !(det < 20.0)) return false;
  const Eigen::Vector2d xx = (seen[1][2] - 2.0 * seen[1][1] + seen[1][0]) / (h * h);
  const Eigen::Vector2d yy = (seen[2][1] - 2.0 * seen[1][1] + seen[0][1]) / (h * h);
  const Eigen::Vector2d xy = (seen[2][2] - seen[2][0] - seen[0][2] + seen[0][0]) / (4 * h * h);
  // ... and its inverse: d_ref = A d - A G(A d, A d) / 2, with G the second derivatives of the forward warp.
  const Eigen::Matrix2d A = A_cur_ref.inverse();
  const auto second = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) -> Eigen::Vector2d {
    return -(A * (xx * (a.x() * b.x()) + xy * (a.x() * b.y() + a.y() * b.x()) + yy * (a.y() * b.y())));
  };
  warp_ref_cur->A = A;
  warp_ref_cur->xx = second(A.col(0), A.col(0));
  warp_ref_cur->xy = second(A.col(0), A.col(1));
  warp_ref_cur->yy = second(A.col(1), A.col(1));
  return true;
}

}  // namespace vip_slam
