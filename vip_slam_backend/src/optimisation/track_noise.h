// SPDX-License-Identifier: BSD-3-Clause
// Estimates the actual pixel error of tracks relative to the reported sigmas, from their residuals against the map's
// landmarks. The reported sigmas cover only the noise of image and matching. A camera whose lens or readout differs
// slightly from its configuration, or whose depth is from another time, has errors of a few tenths of a pixel that a
// track's views share; with sigmas of a tenth the map would weight pixels far too much against depth.
#pragma once

#include <string>
#include <vector>

#include "landmark_views.h"
#include "vip_slam_backend/factors/frame_geometry.h"

namespace vip_slam {

/// Factor on the sigmas of all views, 1 to 8: 1 unless the views of tracks scatter by clearly more than their reported
/// sigmas, and with too few tracks; otherwise the ratio of their residuals against the map to those sigmas. `frames`:
/// the problem's, at the map's present estimate.
double trackNoiseFactor(const LandmarkViews& views, const std::vector<FrameGeometry>& frames);

/// Message to the user about such a factor; empty at 1.
std::string trackNoiseDifference(double factor);

}  // namespace vip_slam
