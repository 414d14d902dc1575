// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/general_motion.h"

#include <algorithm>
#include <random>

#include "pair_errors.h"

namespace vip_slam {

GeneralMotion poseFromDepth(const std::vector<PointPair>& pairs, const SE3& predicted, const RansacOptions& options) {
  GeneralMotion result;
  std::vector<int> pool;
  for (int i = 0; i < static_cast<int>(pairs.size()); ++i) {
    if (pairs[i].depth_previous > 0) pool.push_back(i);
  }
  if (pool.size() < 8) return result;
  std::mt19937 random(options.seed);
  std::uniform_int_distribution<int> pick(0, static_cast<int>(pool.size()) - 1);
  const double limit2 = options.threshold * options.threshold;
  double best = 1e300;
  SE3 T_best;
  for (int k = 0; k < options.iterations; ++k) {
    std::vector<PointPair> sample;
    for (int i = 0; i < 4; ++i) sample.push_back(pairs[pool[pick(random)]]);
    SE3 T = predicted;
    if (!refinePose(sample, std::vector<char>(4, 1), 1e3, &T)) continue;
    double cost = 0;
    const Eigen::Matrix3d R = T.R();
    for (int i : pool) {
      const double e = reprojectionError(pairs[i], R, T.t());
      cost += std::min(limit2, e * e);
      if (cost >= best) break;
    }
    if (cost < best) {
      best = cost;
      T_best = T;
    }
  }
  if (best >= 1e300) return result;
  const auto classify = [&]() {
    const Eigen::Matrix3d R = T_best.R();
    result.inlier.assign(pairs.size(), 0);
    result.inliers = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      result.inlier[i] = pairError(pairs[i], R, T_best.t(), true) < options.threshold;
      result.inliers += result.inlier[i];
    }
  };
  classify();
  if (refinePose(pairs, result.inlier, 0.5 * options.threshold, &T_best)) classify();
  result.ok = true;
  result.T_current_previous = T_best;
  return result;
}

}  // namespace vip_slam
