// SPDX-License-Identifier: BSD-3-Clause
#include "odometry_noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "odometry_factors.h"
#include "vip_slam_backend/factors/relative_pose.h"
#include "vip_slam_core/geometry/relative_motion.h"

namespace vip_slam::backend {
namespace {

// Duration of the motions compared, s: more than the odometry's window, less than what a map without loops drifts over.
constexpr double kShortest = 0.5, kLongest = 2.0;
// A keyframe counts when the map has images from this long after it, s.
constexpr double kSettled = 1.0;
// Number of motions that the mean remembers, and where a single one is cut off, in sigmas of the present mean.
constexpr double kMemory = 50, kCutOff = 3.0;

/// q of the motion that ends at `last` and takes kShortest to kLongest; negative when none is known.
double normalisedError(const Map& map, const MapKeyframe& last) {
  RelativeMotion motion;
  const MapKeyframe* first = &last;
  while (last.data->frame.t - first->data->frame.t < kShortest) {
    // The covariance as the odometry gave it; a culled keyframe in between breaks the chain.
    const RelativeMotion step{first->motion.T_a_b, first->data->motion.covariance};
    if (first->previous == 0 || first->previous != first->data->previous || !step.known()) return -1;
    motion = first == &last ? step : compose(step, motion);
    first = &map.keyframe(first->previous);
  }
  if (last.data->frame.t - first->data->frame.t > kLongest) return -1;
  const Vector6d r = relativePoseResidual(first->state.T_W_I, last.state.T_W_I, motion.T_a_b);
  const double q = r.dot(leastCovariance(motion.covariance).llt().solve(r)) / 6;
  return std::isfinite(q) ? q : -1;
}

}  // namespace

void OdometryNoise::compare(const Map& map, KeyframeId newest) {
  const double until = map.keyframe(newest).data->frame.t - kSettled;
  std::vector<KeyframeId> settled;
  for (KeyframeId id = newest; id > compared_; id = map.keyframe(id).previous)
    if (map.keyframe(id).data->frame.t <= until) settled.push_back(id);
  for (auto id = settled.rbegin(); id != settled.rend(); ++id) {
    compared_ = *id;
    const double q = normalisedError(map, map.keyframe(*id));
    if (q < 0) continue;
    count_ = std::min(count_ + 1, kMemory);
    mean_ += (std::min(q, kCutOff * kCutOff * mean_) - mean_) / count_;
  }
}

double OdometryNoise::varianceFactor() const { return std::max(1.0, mean_); }

}  // namespace vip_slam::backend
