// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/depth/disparity_curve.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {
namespace {

constexpr double kAtOffset = 2.0, kOffsetMatters = 0.001;  // m
constexpr double kMinShrink = 0.1;                         // least 1/z relative to 1/reading, to stay off infinity

}  // namespace

bool measuresDisparity(DepthSensorType type) {
  return type == DepthSensorType::kStereo || type == DepthSensorType::kStructuredLight;
}

double addedForDisparity(double error, double z) { return z / std::max(kMinShrink, 1 - error * z) - z; }

DepthCurve disparityCurve(double error, double range) {
  DepthCurve curve;
  for (int k = 0; k * DepthCurve::kStep < range + DepthCurve::kStep; ++k) {
    const double added = addedForDisparity(error, k * DepthCurve::kStep);
    curve.added.push_back(static_cast<float>(std::clamp(added, -DepthCurve::kMaxEntry, DepthCurve::kMaxEntry)));
  }
  return curve;
}

bool voidsDepthOffset(double change) { return std::abs(addedForDisparity(change, kAtOffset)) > kOffsetMatters; }

}  // namespace vip_slam
