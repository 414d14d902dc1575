#include "vip_slam_frontend/tracking/foretold_motion.h"

#include <algorithm>

namespace vip_slam {

namespace {

constexpr int kLeast = 5;
constexpr double kSigmas = 4.0;
// Shares of the inliers.
constexpr double kSame = 0.95, kMost = 0.67;
// When nearly all points, and so many that are old, tell one motion, the IMU has missed something.
constexpr double kNearlyAll = 0.95;
constexpr int kEnoughOld = 20;
// What else a translation may be off by: blur, rolling rows, a clock. m/s
constexpr double kLeastSpeed = 0.1;

}  // namespace

double mostApart(const ForetoldMotion& foretold) { return kSigmas * foretold.sigma + kLeastSpeed * foretold.interval; }

bool movesByItself(const std::vector<PointPair>& pairs, const RansacResult& found, const RansacResult& bounded) {
  int old_found = 0, old_bounded = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].age < int(kOldPoint)) continue;
    old_found += found.inlier[i] != 0;
    old_bounded += bounded.inlier[i] != 0;
  }
  return 4 * old_found < std::max(kLeast, found.inliers) || 4 * old_bounded > old_found;
}

bool shownByAll(const std::vector<PointPair>& pairs, const RansacResult& found) {
  int old = 0, old_found = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].age < int(kOldPoint)) continue;
    ++old;
    old_found += found.inlier[i] != 0;
  }
  return old >= kEnoughOld && old_found >= kNearlyAll * old && found.inliers >= kNearlyAll * pairs.size();
}

RansacResult rejectOutliers(const std::vector<PointPair>& pairs, const ForetoldMotion& foretold, RansacOptions options,
                            bool* moves) {
  *moves = false;
  options.most_apart = 0;
  options.turn_unknown = foretold.turn_unknown;
  RansacResult found = rejectOutliers(pairs, foretold.T_current_previous, options);
  if (!(foretold.interval > 0) || !found.ok || !found.with_depth) return found;
  options.most_apart = mostApart(foretold);
  if ((found.t_given_rotation - foretold.T_current_previous.t()).norm() < options.most_apart) return found;
  if (!foretold.wary && !foretold.at_rest && shownByAll(pairs, found)) return found;
  RansacResult bounded = rejectOutliers(pairs, foretold.T_current_previous, options);
  // Points far away or few leave the translation open: then both motions explain them.
  if (!foretold.wary && bounded.inliers > kSame * found.inliers) return found;
  if (bounded.inliers > kMost * found.inliers) return bounded;
  *moves = foretold.at_rest || movesByItself(pairs, found, bounded);
  return *moves ? bounded : found;
}

}  // namespace vip_slam
