// SPDX-License-Identifier: BSD-3-Clause
// How far landmarks lie beside the planes that they are on. A wall bows, boards stand off it, a patch that is tracked
// creeps with the view: a homography has no room for it and makes motion of it. The views of a landmark show its
// distance off the plane by their parallax; what these distances scatter beyond their own noise is the surface's.
#pragma once

#include <limits>
#include <vector>

#include "landmark_views.h"
#include "vip_slam_backend/factors/frame_geometry.h"

namespace vip_slam::backend {

/// Of one landmark, along its plane's normal, by all views of its host's track.
struct OffPlane {
  double distance = 0;                                        ///< m
  double variance = std::numeric_limits<double>::infinity();  ///< of the views' pixels, m^2; infinite: no parallax
};

/// By landmark. `plane`: index of its plane, -1: none; `hosts`: the view whose ray meets the plane, counted from the
/// landmark's first, -1: none.
std::vector<OffPlane> distancesOffPlane(const LandmarkViews& views, const std::vector<int>& plane,
                                        const std::vector<int>& hosts, const std::vector<BaPlane>& planes,
                                        const std::vector<FrameGeometry>& geometry);

/// The variance by which points lie beside a surface, m^2: the maximum of its posterior, with outliers cut off. It
/// starts at `prior`, 0 < prior < 0.01, which counts as a few points.
double surfaceVariance(const std::vector<OffPlane>& points, double prior);

/// The same by plane. Each starts with the scatter about all surfaces, and that with `sigma`, m.
std::vector<double> surfaceVariances(const std::vector<OffPlane>& points, const std::vector<int>& plane,
                                     std::size_t planes, double sigma);

/// Whether a landmark may stand for a point of its plane: where the surface's scatter is insignificant beside what its
/// own views see.
bool liesOnPlane(const OffPlane& point, double surface_variance);

}  // namespace vip_slam::backend
