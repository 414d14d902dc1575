// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/depth_unit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam::frontend {

namespace {

constexpr int kAcross = 40;        // samples along a row of the image
constexpr std::size_t kFew = 100;  // samples that decide nothing
constexpr double kLongest = 1.0;   // s: after that a motion is not predicted well enough
// Logarithms of a ratio of distances: least change of a unit, how far a reading may be off it, and how much larger the
// spread of the distances must be, so that a motion does not pass for a unit.
constexpr double kLeast = 0.05, kAgrees = 0.03, kSpread = 5 * kAgrees;
constexpr double kAcceleration = 20;  // m/s^2, that no prediction knows: away from a corner it scales its two walls
constexpr double kShare = 0.7;        // of the view that must agree, near and far

}  // namespace

DepthUnit::DepthUnit(std::shared_ptr<const CameraModel> camera, const DepthNoise& noise)
    : camera_(std::move(camera)), noise_(noise) {
  const int step = std::max(1, camera_->width() / kAcross);
  for (int v = step / 2; v < camera_->height(); v += step) {
    for (int u = step / 2; u < camera_->width(); u += step) {
      Eigen::Vector2d xy;
      if (camera_->undistort({u, v}, &xy)) rays_.emplace_back(cv::Point(u, v), xy.homogeneous());
    }
  }
}

bool DepthUnit::changes(const cv::Mat& depth, const SE3& T_odom_C, double t) {
  open_ = false;
  if (depth.empty()) return false;
  if (std::abs(t - t_) > kLongest) points_.clear();
  const SE3 T_C_odom = T_odom_C.inverse();
  std::vector<std::pair<double, double>> samples;  // logarithms of the distance and of the ratio
  for (const Eigen::Vector3d& point : points_) {
    const Eigen::Vector3d p = T_C_odom * point;
    Eigen::Vector2d uv;
    if (p.z() <= 0 || !camera_->project(p, &uv)) continue;
    const auto u = std::lround(uv.x()), v = std::lround(uv.y());
    if (u < 0 || v < 0 || u >= depth.cols || v >= depth.rows) continue;
    const float z = depth.at<float>(static_cast<int>(v), static_cast<int>(u));
    if (std::isfinite(z) && z > 0) samples.emplace_back(std::log(p.z()), std::log(z / p.z()));
  }
  if (samples.size() < kFew) return false;
  std::sort(samples.begin(), samples.end());
  const std::size_t third = samples.size() / 3;
  const auto common = [](auto begin, auto end) {
    std::vector<double> ratios;
    for (auto it = begin; it != end; ++it) ratios.push_back(it->second);
    return upperMedian(std::move(ratios));
  };
  const double all = common(samples.begin(), samples.end());
  const double metres = std::abs(std::expm1(all)) * std::exp(samples[samples.size() / 2].first);
  if (std::abs(all) < kLeast || metres < 0.5 * kAcceleration * (t - t_) * (t - t_)) return false;
  open_ = true;
  // The nearest and the farthest third each.
  const auto agrees = [all, third](auto begin) {
    const auto n = std::count_if(begin, begin + third, [all](auto& s) { return std::abs(s.second - all) < kAgrees; });
    return static_cast<double>(n) > kShare * static_cast<double>(third);
  };
  const double spread = samples[samples.size() - 1 - third / 2].first - samples[third / 2].first;
  if (spread < kSpread || !agrees(samples.begin()) || !agrees(samples.end() - third)) return false;
  factor_ /= std::exp(all);
  open_ = false;
  return true;
}

void DepthUnit::remember(const cv::Mat& depth, const SE3& T_odom_C, double t) {
  if (depth.empty() || open_) return;
  points_.clear();
  t_ = t;
  for (const auto& [pixel, ray] : rays_) {
    const float z = depth.at<float>(pixel);
    if (noise_.inRange(z)) points_.push_back(T_odom_C * Eigen::Vector3d(z * ray));
  }
}

}  // namespace vip_slam::frontend
