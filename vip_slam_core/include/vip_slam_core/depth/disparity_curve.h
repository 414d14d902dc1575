// Depth of a stereo or structured-light camera whose disparities are all off by the same: with d = f B / z of focal
// length and baseline, 1/z = 1/reading - error, error = (what d has too much) / (f B). Grows with the square of the
// distance.
#pragma once

#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// The camera measures disparities.
bool measuresDisparity(DepthSensorType type);

/// What a reading of `z` m has to be added because of `error`, 1/m.
double addedForDisparity(double error, double z);

/// For readings up to `range`, m; as much of it as a curve may have.
DepthCurve disparityCurve(double error, double range);

/// A change of the error by so much, 1/m, is a millimetre or more at two metres: an offset of depth that was
/// estimated before stood for some of it.
bool voidsDepthOffset(double change);

}  // namespace vip_slam
