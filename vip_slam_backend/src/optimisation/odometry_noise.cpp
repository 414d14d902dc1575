// SPDX-License-Identifier: BSD-3-Clause
#include "odometry_noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "odometry_factors.h"
#include "vip_slam_backend/factors/relative_pose.h"
#include "vip_slam_core/geometry/relative_motion.h"
#include "vip_slam_core/util/significance.h"

namespace vip_slam::backend {
namespace {

// Duration of the motions compared, s, more than the odometry's window; and of what the map must have after one.
constexpr double kSpan = 1.0;

/// q of the motion that ends at `last` and takes kSpan; negative when none is known.
double normalisedError(const Map& map, const MapKeyframe& last) {
  RelativeMotion motion;
  const MapKeyframe* first = &last;
  while (last.data->frame.t - first->data->frame.t < kSpan) {
    // The covariance as the odometry gave it; a culled keyframe in between breaks the chain.
    const RelativeMotion step{first->motion.T_a_b, first->data->motion.covariance};
    if (first->previous == 0 || first->previous != first->data->previous || !step.known()) return -1;
    motion = first == &last ? step : compose(step, motion);
    first = &map.keyframe(first->previous);
  }
  const Vector6d r = relativePoseResidual(first->state.T_W_I, last.state.T_W_I, motion.T_a_b);
  const double q = r.dot(leastCovariance(motion.covariance).llt().solve(r)) / 6;
  return std::isfinite(q) ? q : -1;
}

}  // namespace

void OdometryNoise::compare(const Map& map, KeyframeId newest) {
  const double until = map.keyframe(newest).data->frame.t - kSpan;
  std::vector<KeyframeId> settled;
  for (KeyframeId id = newest; id > compared_; id = map.keyframe(id).previous)
    if (map.keyframe(id).data->frame.t <= until) settled.push_back(id);
  for (auto id = settled.rbegin(); id != settled.rend(); ++id) {
    compared_ = *id;
    const double q = normalisedError(map, map.keyframe(*id));
    if (q < 0) continue;
    mean_ += (std::min(q, kNoiseSigmas * kNoiseSigmas * mean_) - mean_) / ++count_;
  }
}

double OdometryNoise::varianceFactor() const { return std::max(1.0, mean_); }

}  // namespace vip_slam::backend
