// SPDX-License-Identifier: BSD-3-Clause
// Depth error of a stereo or structured-light camera with a common error of all disparities: with d = f B / z of focal
// length and baseline, 1/z = 1/reading - error, error = (excess of d) / (f B). The depth error grows with the square of
// the distance.
#pragma once

#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// Whether this type of camera measures disparities.
bool measuresDisparity(DepthSensorType type);

/// Correction, m, to be added to a reading of `z` m because of `error`, 1/m.
double addedForDisparity(double error, double z);

/// The correction as a curve for readings up to `range`, m, limited to the entries that a curve may have.
DepthCurve disparityCurve(double error, double range);

/// Whether a change of the error, 1/m, is a millimetre or more at two metres: then a depth offset estimated before
/// contains part of it and is invalid.
bool voidsDepthOffset(double change);

}  // namespace vip_slam
