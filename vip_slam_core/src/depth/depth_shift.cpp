// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/depth/depth_shift.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/depth/depth_image.h"

namespace vip_slam {
namespace {

constexpr float kOneSurface = 0.03f;  // relative difference of neighbouring pixels; more is an edge
constexpr double kStraight = 0.02;    // relative deviation of inverse depth of neighbouring nodes from a plane

/// Inverse depth per pixel between two nodes; 0 where one is missing.
double slopeBetween(float a, float b, double pixels) { return a > 0 && b > 0 ? (1.0 / b - 1.0 / a) / pixels : 0.0; }

/// Slope of inverse depth per pixel along a row or column, at the middle one of three nodes.
double slopeAt(float before, float here, float after, double pixels) {
  if (!(before > 0) || !(after > 0)) return 0.0;
  const double bend = 1.0 / before - 2.0 / here + 1.0 / after;
  return std::abs(bend) < kStraight / here ? slopeBetween(before, after, 2 * pixels) : 0.0;
}

float moved(float z, const Eigen::Vector2d& slope, const Eigen::Vector2d& px) {
  const double inverse = 1.0 / z + slope.dot(px);
  // A change by a factor of two within a few pixels is not on one surface.
  return inverse * z > 0.5 && inverse * z < 2.0 ? static_cast<float>(1.0 / inverse) : z;
}

}  // namespace

cv::Mat shiftedDepth(const cv::Mat& depth, const Eigen::Vector2d& px) {
  cv::Mat shifted(depth.size(), CV_32FC1, cv::Scalar(0));
  const int right = static_cast<int>(std::floor(px.x())), down = static_cast<int>(std::floor(px.y()));
  const auto a = static_cast<float>(px.x() - right), b = static_cast<float>(px.y() - down);
  const float w00 = (1 - a) * (1 - b), w01 = a * (1 - b), w10 = (1 - a) * b, w11 = a * b;
  const int nearest_u = a < 0.5f ? 0 : 1, nearest_v = b < 0.5f ? 0 : 1;
  const int first_u = std::max(0, -right), last_u = std::min(depth.cols, depth.cols - 1 - right);
  const int first_v = std::max(0, -down), last_v = std::min(depth.rows, depth.rows - 1 - down);
  for (int v = first_v; v < last_v; ++v) {
    const float* upper = depth.ptr<float>(v + down) + right;
    const float* lower = depth.ptr<float>(v + down + 1) + right;
    const float* nearest = (nearest_v ? lower : upper) + nearest_u;
    float* out = shifted.ptr<float>(v);
    for (int u = first_u; u < last_u; ++u) {
      const float z00 = upper[u], z01 = upper[u + 1], z10 = lower[u], z11 = lower[u + 1];
      const float least = std::min(std::min(z00, z01), std::min(z10, z11));
      const float most = std::max(std::max(z00, z01), std::max(z10, z11));
      const bool whole = z00 > 0 && z01 > 0 && z10 > 0 && z11 > 0 && most - least < kOneSurface * least;  // no NaN
      out[u] = whole ? w00 * z00 + w01 * z01 + w10 * z10 + w11 * z11 : nearest[u];
    }
  }
  return shifted;
}

DepthGrid shiftedDepthGrid(const DepthGrid& grid, const Eigen::Vector2d& px) {
  DepthGrid shifted = grid;
  const auto node = [&grid](int c, int r) {
    return c >= 0 && r >= 0 && c < grid.cols && r < grid.rows ? grid.at(c, r) : 0.f;
  };
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      const float z = grid.at(c, r);
      if (!(z > 0)) continue;
      const Eigen::Vector2d slope(slopeAt(node(c - 1, r), z, node(c + 1, r), grid.stride),
                                  slopeAt(node(c, r - 1), z, node(c, r + 1), grid.stride));
      shifted.z[static_cast<std::size_t>(r) * grid.cols + c] = moved(z, slope, px);
    }
  }
  return shifted;
}

float shiftedDepthAt(const DepthGrid& grid, const Eigen::Vector2d& pixel, float z, const Eigen::Vector2d& px) {
  int c = 0, r = 0;
  if (!(z > 0) || grid.empty() || !grid.nodesAround(pixel, &c, &r)) return z;
  const float z00 = grid.at(c, r), z01 = grid.at(c + 1, r), z10 = grid.at(c, r + 1), z11 = grid.at(c + 1, r + 1);
  if (!(z00 > 0) || !(z01 > 0) || !(z10 > 0) || !(z11 > 0)) return z;
  const double right = 0.5 * (slopeBetween(z00, z01, grid.stride) + slopeBetween(z10, z11, grid.stride));
  const double down = 0.5 * (slopeBetween(z00, z10, grid.stride) + slopeBetween(z01, z11, grid.stride));
  const double twist = 1.0 / z00 - 1.0 / z01 - 1.0 / z10 + 1.0 / z11;
  const double there = 1.0 / z00 + Eigen::Vector2d(right, down).dot(pixel - grid.pixel(c, r));
  if (std::abs(twist) > kStraight / z || std::abs(there - 1.0 / z) > kStraight / z) return z;
  return moved(z, {right, down}, px);
}

}  // namespace vip_slam
