// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/depth_unit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <opencv2/imgproc.hpp>

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
// Of a view at one distance the least change of a unit, as a logarithm; correlation of two images that are of the same
// view, and their least contrast, one sigma in grey levels.
constexpr double kLeastPlain = 0.4, kSameView = 0.8, kContrast = 3.0;

struct Sample {
  double distance, ratio;  ///< logarithms: as predicted; of the reading over it
  double before, now;      ///< brightness
};

/// Of a coarse image; 0 without one. Its last row and column stand for what is left over beyond them.
double brightness(const cv::Mat& small, long u, long v) {
  if (small.empty()) return 0.0;
  return small.at<std::uint8_t>(std::min(static_cast<int>(v), small.rows - 1),
                                std::min(static_cast<int>(u), small.cols - 1));
}

bool sameView(const std::vector<Sample>& samples) {
  double before = 0, now = 0, bb = 0, nn = 0, bn = 0;
  const double n = static_cast<double>(samples.size());
  for (const Sample& s : samples) before += s.before / n, now += s.now / n;
  for (const Sample& s : samples) {
    bb += (s.before - before) * (s.before - before) / n;
    nn += (s.now - now) * (s.now - now) / n;
    bn += (s.before - before) * (s.now - now) / n;
  }
  return std::min(bb, nn) > kContrast * kContrast && bn > kSameView * std::sqrt(bb * nn);
}

}  // namespace

DepthUnit::DepthUnit(std::shared_ptr<const CameraModel> camera, const DepthNoise& noise)
    : camera_(std::move(camera)), noise_(noise), step_(std::max(1, camera_->width() / kAcross)) {
  for (int v = step_ / 2; v < camera_->height(); v += step_) {
    for (int u = step_ / 2; u < camera_->width(); u += step_) {
      Eigen::Vector2d xy;
      if (camera_->undistort({u, v}, &xy)) rays_.emplace_back(cv::Point(u, v), xy.homogeneous());
    }
  }
}

cv::Mat DepthUnit::coarse(const cv::Mat& gray) const {
  cv::Mat small;
  const cv::Size size(std::max(1, gray.cols / step_), std::max(1, gray.rows / step_));
  if (!gray.empty()) cv::resize(gray, small, size, 0, 0, cv::INTER_AREA);
  return small;
}

bool DepthUnit::changes(const cv::Mat& depth, const cv::Mat& gray, const SE3& T_odom_C, double t) {
  open_ = false;
  if (depth.empty()) return false;
  if (std::abs(t - t_) > kLongest) points_.clear();
  const SE3 T_C_odom = T_odom_C.inverse();
  const cv::Mat small = coarse(gray);
  std::vector<Sample> samples;
  for (const Seen& seen : points_) {
    const Eigen::Vector3d p = T_C_odom * seen.point;
    Eigen::Vector2d uv;
    if (p.z() <= 0 || !camera_->project(p, &uv)) continue;
    const auto u = std::lround(uv.x()), v = std::lround(uv.y());
    if (u < 0 || v < 0 || u >= depth.cols || v >= depth.rows) continue;
    const float z = depth.at<float>(static_cast<int>(v), static_cast<int>(u));
    if (!std::isfinite(z) || z <= 0) continue;
    samples.push_back({std::log(p.z()), std::log(z / p.z()), seen.brightness, brightness(small, u / step_, v / step_)});
  }
  if (samples.size() < kFew) return false;
  std::sort(samples.begin(), samples.end(), [](auto& a, auto& b) { return a.distance < b.distance; });
  const std::size_t third = samples.size() / 3;
  const auto common = [](auto begin, auto end) {
    std::vector<double> ratios;
    for (auto it = begin; it != end; ++it) ratios.push_back(it->ratio);
    return upperMedian(std::move(ratios));
  };
  const double all = common(samples.begin(), samples.end());
  const double metres = std::abs(std::expm1(all)) * std::exp(samples[samples.size() / 2].distance);
  if (std::abs(all) < kLeast || metres < 0.5 * kAcceleration * (t - t_) * (t - t_)) return false;
  open_ = true;
  // The nearest and the farthest third each.
  const auto agrees = [all, third](auto begin) {
    const auto n = std::count_if(begin, begin + third, [all](auto& s) { return std::abs(s.ratio - all) < kAgrees; });
    return static_cast<double>(n) > kShare * static_cast<double>(third);
  };
  const double spread = samples[samples.size() - 1 - third / 2].distance - samples[third / 2].distance;
  const bool shown = spread > kSpread || (std::abs(all) > kLeastPlain && sameView(samples));
  if (!shown || !agrees(samples.begin()) || !agrees(samples.end() - third)) return false;
  factor_ /= std::exp(all);
  open_ = false;
  return true;
}

void DepthUnit::remember(const cv::Mat& depth, const cv::Mat& gray, const SE3& T_odom_C, double t) {
  if (depth.empty() || open_) return;
  points_.clear();
  t_ = t;
  const cv::Mat small = coarse(gray);
  for (const auto& [pixel, ray] : rays_) {
    const float z = depth.at<float>(pixel);
    if (!noise_.inRange(z)) continue;
    points_.push_back({T_odom_C * Eigen::Vector3d(z * ray), brightness(small, pixel.x / step_, pixel.y / step_)});
  }
}

}  // namespace vip_slam::frontend
