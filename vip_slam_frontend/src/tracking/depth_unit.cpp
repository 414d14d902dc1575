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
  cv::Point before, now;   ///< pixels of the one image and of the other
};

/// An image by its mean brightness about each pixel that is looked at.
class Coarse {
 public:
  Coarse(const cv::Mat& gray, int step) : step_(step) {
    const cv::Size size(std::max(1, gray.cols / step), std::max(1, gray.rows / step));
    if (!gray.empty()) cv::resize(gray, small_, size, 0, 0, cv::INTER_AREA);
  }

  /// 0 without an image. The last row and column stand for what is left over beyond them.
  double at(const cv::Point& pixel) const {
    if (small_.empty()) return 0.0;
    return small_.at<std::uint8_t>(std::min(pixel.y / step_, small_.rows - 1),
                                   std::min(pixel.x / step_, small_.cols - 1));
  }

 private:
  int step_;
  cv::Mat small_;
};

/// Whether the one image explains most of the variance of the other.
bool sameView(const std::vector<Sample>& samples, const Coarse& image_before, const Coarse& image_now) {
  double before = 0, now = 0, bb = 0, nn = 0, bn = 0;
  const double n = static_cast<double>(samples.size());
  for (const Sample& s : samples) before += image_before.at(s.before) / n, now += image_now.at(s.now) / n;
  for (const Sample& s : samples) {
    const double b = image_before.at(s.before) - before, c = image_now.at(s.now) - now;
    bb += b * b;
    nn += c * c;
    bn += b * c;
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

bool DepthUnit::changes(const cv::Mat& depth, const cv::Mat& gray, const SE3& T_odom_C, double t) {
  open_ = false;
  if (depth.empty()) return false;
  const SE3 T_C_odom = T_odom_C.inverse();
  std::vector<Sample> samples;
  samples.reserve(points_.size());
  for (const Seen& seen : points_) {
    const Eigen::Vector3d p = T_C_odom * seen.point;
    Eigen::Vector2d uv;
    if (p.z() <= 0 || !camera_->project(p, &uv)) continue;
    const auto u = std::lround(uv.x()), v = std::lround(uv.y());
    if (u < 0 || v < 0 || u >= depth.cols || v >= depth.rows) continue;
    const float z = depth.at<float>(static_cast<int>(v), static_cast<int>(u));
    if (!std::isfinite(z) || z <= 0) continue;
    samples.push_back({p.z(), std::log(z / p.z()), seen.pixel, {static_cast<int>(u), static_cast<int>(v)}});
  }
  if (samples.size() < kEnough) return false;
  const auto common = [](auto begin, auto end, auto value) {
    std::vector<double> values;
    for (auto it = begin; it != end; ++it) values.push_back(value(*it));
    return upperMedian(std::move(values));
  };
  const double all = common(samples.begin(), samples.end(), [](auto& s) { return s.ratio; });
  const double middle = common(samples.begin(), samples.end(), [](auto& s) { return s.distance; });
  const double prior = CalibrationOptions().sigma_depth_scale, moved = gravityVector().norm() * (t - t_) * (t - t_);
  if (std::abs(all) < kGateSigmas * prior || std::abs(std::expm1(all)) * middle < moved) return false;
  open_ = true;
  const auto sigmas = [this, all](auto& s) { return std::abs(s.ratio - all) * s.distance / noise_.sigma(s.distance); };
  std::sort(samples.begin(), samples.end(), [](auto& a, auto& b) { return a.distance < b.distance; });
  const auto third = static_cast<std::ptrdiff_t>(samples.size() / 3);
  if (common(samples.begin(), samples.begin() + third, sigmas) > kGateSigmas) return false;
  if (common(samples.end() - third, samples.end(), sigmas) > kGateSigmas) return false;
  if (!sameView(samples, {gray_, step_}, {gray, step_})) return false;
  factor_ /= std::exp(all);
  open_ = false;
  return true;
}

void DepthUnit::remember(const cv::Mat& depth, const cv::Mat& gray, const SE3& T_odom_C, double t) {
  if (depth.empty() || open_) return;
  points_.clear();
  gray_ = gray;
  t_ = t;
  for (const auto& [pixel, ray] : rays_) {
    const float z = depth.at<float>(pixel);
    if (!noise_.inRange(z)) continue;
    points_.push_back({T_odom_C * Eigen::Vector3d(z * ray), pixel});
  }
}

}  // namespace vip_slam::frontend
