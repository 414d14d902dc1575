// SPDX-License-Identifier: BSD-3-Clause
// Convention of front end and back end on the sigma that a feature reports.
#pragma once

namespace vip_slam {

/// Feature::pixel_sigma of tracks that began where there is no depth is above this, px; that of others below, unless
/// their patch was magnified a lot. A patch warped as if far away slides with the motion, all such patches the same
/// way, which a sigma does not describe: on planes they make the motion 0.1 to 0.3 % too long.
constexpr float kSlidingPixelSigma = 0.4f;

}  // namespace vip_slam
