// What the IMU foretells of the camera's motion between two images. When somebody walks by so close that he fills the
// view, the motion that explains most points is his, not the camera's; the IMU knows better for some seconds.
#pragma once

#include <cstdint>
#include <vector>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_frontend/tracking/outlier_rejection.h"

namespace vip_slam {

/// Images after which a point has shown that it stands still.
constexpr std::uint32_t kOldPoint = 8;

struct ForetoldMotion {
  SE3 T_current_previous;
  double sigma = 0;           ///< of the translation along its least certain axis, m
  double interval = 0;        ///< between the two images, s; 0: nothing is foretold
  bool turn_unknown = false;  ///< the IMU had a gap
  bool wary = false;          ///< something moved a moment ago: when in doubt the IMU is right
  bool at_rest = false;  ///< the IMU has not stirred since the camera stood still: points that move do so themselves
};

/// How far a translation may be from the foretold one, m.
double mostApart(const ForetoldMotion& foretold);

/// Whether `found`, the motion that explains most pairs, is that of something else: the IMU excludes it, and the points
/// that speak for it are new, or others that are not agree with the IMU. Points followed for long that all of a sudden
/// contradict the IMU together are believed: then the IMU, or what was made of it, is wrong. `bounded`: the motion no
/// further than mostApart() from the foretold one that explains most.
bool movesByItself(const std::vector<PointPair>& pairs, const RansacResult& found, const RansacResult& bounded);

/// Whether nearly all points agree with `found`, many of them old: a scene does not begin to move as one.
bool shownByAll(const std::vector<PointPair>& pairs, const RansacResult& found);

/// Outliers rejected with both in mind. `options.most_apart` is set here. `moves`: whether what is seen moves by
/// itself; then only points that agree with the IMU are inliers.
RansacResult rejectOutliers(const std::vector<PointPair>& pairs, const ForetoldMotion& foretold, RansacOptions options,
                            bool* moves);

}  // namespace vip_slam
