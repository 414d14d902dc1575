// SPDX-License-Identifier: BSD-3-Clause
#include "plane_gate.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/significance.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr double kFarthest = 0.05;               // metres
constexpr double kMaxNear = 0.5, kMaxFar = 0.9;  // shares that must be kept, with the median within kFarthest or not

}  // namespace

PlaneGate::PlaneGate(const PlaneObservation& observation, const Eigen::Vector4d& plane_C) : observation_(observation) {
  const std::vector<PlaneSample>& points = observation.points;
  // With residuals as small as the noise there is nothing to remove.
  if (points.empty() || plane_C.dot(observation.G * plane_C) <= observation.weight_scale * points.size()) return;
  std::vector<double> distance;
  for (const PlaneSample& p : points) distance.push_back(plane_C.dot(p.p_C.cast<double>().homogeneous()));
  const double median = upperMedian(distance);
  for (std::size_t k = 0; k < points.size(); ++k)
    if (std::abs(distance[k] - median) <= kNoiseSigmas * points[k].sigma) kept_.push_back(static_cast<int>(k));
  all_ = kept_.size() == points.size();
  const double share = std::abs(median) > kFarthest ? kMaxFar : kMaxNear;
  if (kept_.size() < share * points.size()) kept_.clear();
}

Eigen::Matrix4d PlaneGate::G() const {
  if (all_) return observation_.G;
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const int k : kept_) {
    const Eigen::Vector4d p = observation_.points[k].p_C.cast<double>().homogeneous();
    const double sigma = observation_.points[k].sigma;
    sum += p * p.transpose() / (sigma * sigma);
  }
  return observation_.weight_scale * sum;
}

}  // namespace vip_slam
