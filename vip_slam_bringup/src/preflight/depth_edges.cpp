// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/preflight/depth_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "vip_slam_core/sensor/depth_to_colour.h"

namespace vip_slam {
namespace {

constexpr double kMoved = 2.5;       // px of distortion from which the two places can be told apart
constexpr float kJump = 0.08f;       // of the nearer depth, from one pixel to the next: a depth edge
constexpr std::size_t kEdges = 100;  // in one image, for it to count

/// Strength of the edges of a smoothed image within a pixel of (u, v), grey levels: registration is not better than
/// that. By the 3 x 3 Sobel operator, at these pixels alone: depth has few edges.
float edgeStrength(const cv::Mat& smooth, int u, int v) {
  const auto grey = [&](int x, int y) {
    return int(smooth.at<std::uint8_t>(std::clamp(y, 0, smooth.rows - 1), std::clamp(x, 0, smooth.cols - 1)));
  };
  int most = 0;  // of 64 times the squared strength
  for (int y = v - 1; y <= v + 1; ++y)
    for (int x = u - 1; x <= u + 1; ++x) {
      const int left = grey(x - 1, y - 1) + 2 * grey(x - 1, y) + grey(x - 1, y + 1);
      const int right = grey(x + 1, y - 1) + 2 * grey(x + 1, y) + grey(x + 1, y + 1);
      const int above = grey(x - 1, y - 1) + 2 * grey(x, y - 1) + grey(x + 1, y - 1);
      const int below = grey(x - 1, y + 1) + 2 * grey(x, y + 1) + grey(x + 1, y + 1);
      most = std::max(most, (right - left) * (right - left) + (below - above) * (below - above));
    }
  return std::sqrt(static_cast<float>(most)) / 8;
}

bool jumps(float a, float b) { return a > 0 && b > 0 && std::abs(a - b) > kJump * std::min(a, b); }

}  // namespace

DepthEdges::DepthEdges(const CameraIntrinsics& colour)
    : distorted_(colour.height, colour.width, CV_32FC2, cv::Scalar::all(std::numeric_limits<double>::quiet_NaN())) {
  if (largestDistortion(colour) < kMoved) return;
  const auto lens = makeCamera(colour), pinhole = makeCamera(pinholeOf(colour));
  for (int v = 0; v < colour.height; ++v) {
    for (int u = 0; u < colour.width; ++u) {
      const Eigen::Vector2d uv(u, v);
      Eigen::Vector2d xy, seen;
      if (!pinhole->undistort(uv, &xy) || !lens->project(Eigen::Vector3d(xy.x(), xy.y(), 1), &seen)) continue;
      if (!lens->inImage(seen, 1) || (seen - uv).norm() <= kMoved) continue;
      distorted_.at<cv::Vec2f>(v, u) = {static_cast<float>(seen.x()), static_cast<float>(seen.y())};
      moves_ = true;
    }
  }
}

void DepthEdges::add(const cv::Mat& grey, const cv::Mat& depth) {
  if (grey.size() != distorted_.size() || depth.size() != distorted_.size() || !moves_) return;
  std::vector<cv::Point> edges;  // in the image of the camera without lens
  for (int v = 0; v + 1 < depth.rows; ++v) {
    const auto* seen = distorted_.ptr<cv::Vec2f>(v);
    const auto *z = depth.ptr<float>(v), *below = depth.ptr<float>(v + 1);
    for (int u = 0; u + 1 < depth.cols; ++u)
      if (!std::isnan(seen[u][0]) && (jumps(z[u], z[u + 1]) || jumps(z[u], below[u]))) edges.emplace_back(u, v);
  }
  if (edges.size() < kEdges) return;
  cv::Mat smooth;
  cv::GaussianBlur(grey, smooth, {0, 0}, 1.0);
  double as_colour = 0, as_undistorted = 0;
  for (const cv::Point& p : edges) {
    const cv::Vec2f seen = distorted_.at<cv::Vec2f>(p);
    as_colour += edgeStrength(smooth, p.x, p.y);
    as_undistorted += edgeStrength(smooth, cvRound(seen[0]), cvRound(seen[1]));
  }
  record_.edges += edges.size();
  record_.as_colour.push_back(as_colour / double(edges.size()));
  record_.as_undistorted.push_back(as_undistorted / double(edges.size()));
}

}  // namespace vip_slam
