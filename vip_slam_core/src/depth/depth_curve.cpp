// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/depth/depth_curve.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kNearest = 1e-3;      // m
constexpr double kSteepest = 0.5;      // of the curve, m/m
constexpr int kInverseIterations = 4;  // each reduces the error by the curve's slope, a few per cent

}  // namespace

DepthCurve chained(const DepthCurve& first, const DepthCurve& then) {
  if (then.empty()) return first;
  DepthCurve both;
  for (std::size_t k = 0; k < std::max(first.added.size(), then.added.size()); ++k) {
    const auto z = static_cast<float>(DepthCurve::kStep * static_cast<double>(k));
    const float once = first.at(z);
    both.added.push_back(once + then.at(z + once));
  }
  return both;
}

std::string validateDepthCurve(const DepthCurve& curve) {
  for (std::size_t k = 0; k < curve.added.size(); ++k) {
    const double here = curve.added[k], z = DepthCurve::kStep * static_cast<double>(k);
    if (!(std::abs(here) <= DepthCurve::kMaxEntry)) {
      return formatted("%g m are added at %g m, expected at most %g", here, z, DepthCurve::kMaxEntry);
    }
    if (k > 0 && here - curve.added[k - 1] < -kSteepest * DepthCurve::kStep) {
      return formatted("falls by %g m up to %g m, expected at most %g from entry to entry", curve.added[k - 1] - here,
                       z, kSteepest * DepthCurve::kStep);
    }
  }
  return "";
}

void applyDepthCurve(const DepthCurve& curve, cv::Mat* depth) {
  CV_Assert(depth->type() == CV_32FC1);
  if (curve.empty()) return;
  for (int r = 0; r < depth->rows; ++r) {
    float* z = depth->ptr<float>(r);
    for (int c = 0; c < depth->cols; ++c) {
      if (z[c] > 0) z[c] = std::max(static_cast<float>(kNearest), z[c] + curve.at(z[c]));
    }
  }
}

DepthChange::DepthChange(const CameraCorrection& from, const CameraCorrection& to)
    : from_(from), to_(to), same_curve_(from.curve == to.curve) {}

float DepthChange::operator()(float z) const {
  if (!(z > 0)) return z;
  double bent = (z - from_.offset) / from_.scale;
  if (!same_curve_) {
    double reading = bent;
    for (int i = 0; i < kInverseIterations && !from_.curve.empty(); ++i) {
      reading = bent - from_.curve.at(static_cast<float>(reading));
    }
    bent = reading + to_.curve.at(static_cast<float>(reading));
  }
  const double changed = to_.scale * bent + to_.offset;
  return static_cast<float>(std::max(kNearest, changed));
}

}  // namespace vip_slam
