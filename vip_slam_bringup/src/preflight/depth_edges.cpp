#include "vip_slam_bringup/preflight/depth_edges.h"

#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

#include "vip_slam_core/sensor/depth_to_colour.h"

namespace vip_slam {
namespace {

constexpr double kMoved = 2.5;       // px of distortion from which the two places can be told apart
constexpr float kJump = 0.08f;       // of the nearer depth, from one pixel to the next: a depth edge
constexpr std::size_t kEdges = 100;  // in one image, for it to count

/// Strength of the image's edges within a pixel, grey levels: registration is not better than that.
cv::Mat edgeStrength(const cv::Mat& grey) {
  cv::Mat smooth, dx, dy, strength;
  cv::GaussianBlur(grey, smooth, {0, 0}, 1.0);
  cv::Sobel(smooth, dx, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(smooth, dy, CV_32F, 0, 1, 3, 0.125);
  cv::magnitude(dx, dy, strength);
  cv::dilate(strength, strength, cv::Mat());
  return strength;
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
      if (lens->inImage(seen, 1) && (seen - uv).norm() > kMoved)
        distorted_.at<cv::Vec2f>(v, u) = {static_cast<float>(seen.x()), static_cast<float>(seen.y())};
    }
  }
}

void DepthEdges::add(const cv::Mat& grey, const cv::Mat& depth) {
  if (grey.size() != distorted_.size() || depth.size() != distorted_.size()) return;
  const cv::Mat strength = edgeStrength(grey);
  double as_colour = 0, as_undistorted = 0;
  std::size_t edges = 0;
  for (int v = 0; v + 1 < depth.rows; ++v) {
    for (int u = 0; u + 1 < depth.cols; ++u) {
      const cv::Vec2f seen = distorted_.at<cv::Vec2f>(v, u);
      const float z = depth.at<float>(v, u);
      if (std::isnan(seen[0]) || !(jumps(z, depth.at<float>(v, u + 1)) || jumps(z, depth.at<float>(v + 1, u))))
        continue;
      as_colour += strength.at<float>(v, u);
      as_undistorted += strength.at<float>(cvRound(seen[1]), cvRound(seen[0]));
      ++edges;
    }
  }
  if (edges < kEdges) return;
  record_.edges += edges;
  record_.as_colour.push_back(as_colour / double(edges));
  record_.as_undistorted.push_back(as_undistorted / double(edges));
}

}  // namespace vip_slam
