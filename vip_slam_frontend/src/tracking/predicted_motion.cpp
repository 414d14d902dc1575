// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/predicted_motion.h"

#include <cmath>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

namespace {

/// After a while without images the view has changed: optical flow then finds mostly chance matches, and a few that
/// agree on some motion would make a velocity of it.
bool matchedByChance(const PredictedMotion& prediction, const RansacResult& found, std::size_t pairs) {
  return prediction.interval > kMoment && (!found.ok || 2 * static_cast<std::size_t>(found.inliers) < pairs);
}

}  // namespace

double mostApart(const PredictedMotion& prediction) { return kGateSigmas * std::hypot(prediction.sigma, kMotionError); }

bool movesByItself(const std::vector<PointPair>& pairs, const RansacResult& found, const RansacResult& bounded) {
  int old_found = 0, old_bounded = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].age < int(kOldPoint)) continue;
    old_found += found.inlier[i] != 0;
    old_bounded += bounded.inlier[i] != 0;
  }
  return 4 * old_found < found.inliers || 4 * old_bounded > old_found;
}

bool shownByAll(const std::vector<PointPair>& pairs, const RansacResult& found) {
  int old = 0, old_found = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].age < int(kOldPoint)) continue;
    ++old;
    old_found += found.inlier[i] != 0;
  }
  return old >= kEnough && old_found >= kGateProbability * old && found.inliers >= kGateProbability * pairs.size();
}

RansacResult rejectOutliers(const std::vector<PointPair>& pairs, const PredictedMotion& prediction,
                            RansacOptions options, bool* moves) {
  *moves = false;
  options.most_apart = 0;
  options.turn_unknown = prediction.turn_unknown;
  RansacResult found = rejectOutliers(pairs, prediction.T_current_previous, options);
  if (matchedByChance(prediction, found, pairs.size())) {
    found.ok = false;
    found.inlier.assign(pairs.size(), 0);
    found.inliers = 0;
    return found;
  }
  if (!prediction.judges || !found.ok || !found.with_depth) return found;
  options.most_apart = mostApart(prediction);
  if ((found.t_given_rotation - prediction.T_current_previous.t()).norm() < options.most_apart) return found;
  if (!prediction.wary && !prediction.at_rest && shownByAll(pairs, found)) return found;
  RansacResult bounded = rejectOutliers(pairs, prediction.T_current_previous, options);
  // Few or distant points hardly constrain the translation: then both motions explain them.
  if (!prediction.wary && bounded.inliers > kGateProbability * found.inliers) return found;
  if (2 * bounded.inliers > found.inliers) return bounded;
  *moves = prediction.at_rest || movesByItself(pairs, found, bounded);
  return *moves ? bounded : found;
}

}  // namespace vip_slam
