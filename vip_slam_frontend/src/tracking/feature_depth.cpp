// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/feature_depth.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/tracking/patch_surface.h"

namespace vip_slam {

namespace {

constexpr int kRadius = 3;
// Accuracy of a corner's position relative to the depth image, px.
constexpr double kPixelError = 0.5;

struct Reading {
  double x, y, z;  // offset from the corner in px; metres
  double sigma;
};

/// 1/z = c0 + c1 x + c2 y.
struct InversePlane {
  Eigen::Vector3d c = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  double z(double x, double y) const {
    const double inverse = c.x() + c.y() * x + c.z() * y;
    return inverse > 1e-3 ? 1.0 / inverse : 1e3;
  }
  bool explains(const Reading& r) const { return std::abs(z(r.x, r.y) - r.z) < kReadingSigmas * r.sigma; }
};

template <typename Use>
bool fit(const std::vector<Reading>& readings, const Use& use, InversePlane* plane) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  int count = 0;
  for (const Reading& r : readings) {
    if (!use(r)) continue;
    // sigma of 1/z is sigma_z / z^2.
    const double w = r.z * r.z / r.sigma;
    const Eigen::Vector3d J(w, w * r.x, w * r.y);
    A += J * J.transpose();
    b += J * (w / r.z);
    ++count;
  }
  if (count < kEnough) return false;
  bool invertible = false;
  double determinant;
  // Scaled so that the determinant says whether the pixels span a plane rather than a line.
  const double scale = A(0, 0);
  (A / scale).computeInverseAndDetWithCheck(plane->covariance, determinant, invertible, 1e-2);
  if (!invertible) return false;
  plane->covariance /= scale;
  plane->c = plane->covariance * b;
  return plane->c.x() > 1e-3;
}

template <typename Use>
int countExplained(const std::vector<Reading>& readings, const InversePlane& plane, const Use& use) {
  int count = 0;
  for (const Reading& r : readings) count += use(r) && plane.explains(r);
  return count;
}

FeatureDepth evaluate(const InversePlane& plane, FeatureDepth::Source source, const DepthNoise& noise) {
  FeatureDepth result;
  result.source = FeatureDepth::Source::kUnclear;
  const double z = plane.z(0, 0);
  const double slope = z * z * plane.c.tail<2>().norm();  // metres per px
  const double fitted = z * z * std::sqrt(std::max(0.0, plane.covariance(0, 0)));
  const double sigma = std::hypot(noise.sigma(z), std::hypot(kPixelError * slope, fitted));
  if (!noise.inRange(z)) return result;
  result.z = static_cast<float>(z);
  result.sigma = static_cast<float>(sigma);
  result.source = source;
  return result;
}

/// The nearer of two surfaces, split at the widest gap between sorted readings.
FeatureDepth nearSide(const std::vector<Reading>& readings, const DepthNoise& noise) {
  FeatureDepth unclear;
  unclear.source = FeatureDepth::Source::kUnclear;
  const int n = static_cast<int>(readings.size());
  std::vector<double> sorted;
  for (const Reading& r : readings) sorted.push_back(r.z);
  std::sort(sorted.begin(), sorted.end());
  int split = -1;
  double widest = 0;
  for (int i = kEnough; i < n; ++i) {
    const double gap = sorted[i] - sorted[i - 1];
    if (gap > widest) {
      widest = gap;
      split = i;
    }
  }
  if (split < 0 || widest < 6.0 * noise.sigma(sorted[split - 1])) return unclear;
  const double limit = 0.5 * (sorted[split] + sorted[split - 1]);
  const auto near = [limit](const Reading& r) { return r.z < limit; };
  InversePlane plane;
  if (!fit(readings, near, &plane)) return unclear;
  if (countExplained(readings, plane, near) < 0.85 * split) return unclear;
  // Readings beyond the gap must also lie behind the plane: else the gap was between columns of a slanted surface.
  int behind = 0;
  for (const Reading& r : readings) behind += !near(r) && r.z > plane.z(r.x, r.y) + kReadingSigmas * r.sigma;
  if (behind < 0.85 * (n - split)) return unclear;
  return evaluate(plane, FeatureDepth::Source::kRim, noise);
}

}  // namespace

FeatureDepth featureDepth(const cv::Mat& depth, double u, double v, const DepthNoise& noise) {
  FeatureDepth result;
  if (depth.empty()) return result;
  result.z = safeDepth(depth, u, v, noise);
  if (result.z > 0) {
    result.sigma = static_cast<float>(noise.sigma(result.z));
    result.source = FeatureDepth::Source::kSmooth;
    return result;
  }
  if (!(u > -0.5 && v > -0.5 && u < depth.cols - 0.5 && v < depth.rows - 0.5)) return result;
  const int cu = static_cast<int>(std::floor(u + 0.5)), cv = static_cast<int>(std::floor(v + 0.5));
  std::vector<Reading> readings;
  for (int y = std::max(0, cv - kRadius); y <= std::min(depth.rows - 1, cv + kRadius); ++y) {
    const float* row = depth.ptr<float>(y);
    for (int x = std::max(0, cu - kRadius); x <= std::min(depth.cols - 1, cu + kRadius); ++x) {
      if (!noise.inRange(row[x])) continue;  // also refuses 0 and NaN
      readings.push_back({x - u, y - v, row[x], noise.sigma(row[x])});
    }
  }
  const auto n = static_cast<int>(readings.size());
  if (n > 0) result.source = FeatureDepth::Source::kUnclear;
  const int side = 2 * kRadius + 1;
  if (n < kMinValid * side * side) return result;
  const auto all = [](const Reading&) { return true; };
  InversePlane plane;
  if (fit(readings, all, &plane) && countExplained(readings, plane, all) >= kGateProbability * n) {
    return evaluate(plane, FeatureDepth::Source::kSlanted, noise);
  }
  return nearSide(readings, noise);
}

}  // namespace vip_slam
