// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/depth_unit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "vip_slam_core/depth/grid_spacing.h"
#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_frontend/filter/filter_options.h"
#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/tracking/frozen_depth.h"

namespace vip_slam::frontend {

namespace {

struct Sample {
  double distance, ratio;  ///< as predicted, m; logarithm of the reading over it
  double before, now;      ///< brightness
};

/// Of a coarse image; 0 without one. Its last row and column stand for what is left over beyond them.
double brightness(const cv::Mat& small, long u, long v) {
  if (small.empty()) return 0.0;
  return small.at<std::uint8_t>(std::min(static_cast<int>(v), small.rows - 1),
                                std::min(static_cast<int>(u), small.cols - 1));
}

/// Whether the one image explains most of the variance of the other.
bool sameView(const std::vector<Sample>& samples) {
  double before = 0, now = 0, bb = 0, nn = 0, bn = 0;
  const double n = static_cast<double>(samples.size());
  for (const Sample& s : samples) before += s.before / n, now += s.now / n;
  for (const Sample& s : samples) {
    bb += (s.before - before) * (s.before - before);
    nn += (s.now - now) * (s.now - now);
    bn += (s.before - before) * (s.now - now);
  }
  const double rounding = n / 12;  // grey levels are whole numbers
  return std::min(bb, nn) > rounding && bn > 0 && bn * bn > bb * nn - bn * bn;
}

}  // namespace

DepthUnit::DepthUnit(std::shared_ptr<const CameraModel> camera, const DepthNoise& noise)
    : camera_(std::move(camera)), noise_(noise), step_(strideOn(camera_->width(), camera_->height(), kReadingStep)) {
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
    samples.push_back({p.z(), std::log(z / p.z()), seen.brightness, brightness(small, u / step_, v / step_)});
  }
  if (samples.size() < kEnough) return false;
  std::sort(samples.begin(), samples.end(), [](auto& a, auto& b) { return a.distance < b.distance; });
  const auto common = [](auto begin, auto end, auto value) {
    std::vector<double> values;
    for (auto it = begin; it != end; ++it) values.push_back(value(*it));
    return upperMedian(std::move(values));
  };
  const double all = common(samples.begin(), samples.end(), [](auto& s) { return s.ratio; });
  const double metres = std::abs(std::expm1(all)) * samples[samples.size() / 2].distance;
  const double prior = CalibrationOptions().sigma_depth_scale, moved = gravityVector().norm() * (t - t_) * (t - t_);
  if (std::abs(all) < kGateSigmas * prior || metres < moved) return false;
  open_ = true;
  const auto sigmas = [this, all](auto& s) { return std::abs(s.ratio - all) * s.distance / noise_.sigma(s.distance); };
  const auto third = static_cast<std::ptrdiff_t>(samples.size() / 3);
  if (common(samples.begin(), samples.begin() + third, sigmas) > kGateSigmas) return false;
  if (common(samples.end() - third, samples.end(), sigmas) > kGateSigmas || !sameView(samples)) return false;
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
