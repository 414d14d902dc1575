// What front end and back end agree on about the noise that a feature tells of itself.
#pragma once

namespace vip_slam {

/// Feature::pixel_sigma of tracks that began where the depth shows no surface lies above this, px; that of others below
/// it, unless their patch grew much. A patch warped as if far away slides with the motion, all such patches the same
/// way, which no sigma describes: on planes they make the motion 0.1 to 0.3 % too long.
constexpr float kSlidingPixelSigma = 0.4f;

}  // namespace vip_slam
