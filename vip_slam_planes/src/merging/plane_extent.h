// SPDX-License-Identifier: BSD-3-Clause
// Relative position of two planes' areas: contact, distance, heights.
#pragma once

#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

/// Comparison of the smaller plane's area with the larger plane.
struct Contact {
  int cells = 0, shared = 0, near = 0;
  double worst_border = 0;   ///< largest distance of a border point of the smaller to the larger plane
  double worst_meeting = 0;  ///< largest distance of a point of the larger, where they meet, to the smaller plane
  double separation = 0;     ///< mean distance where shared
};

/// `gap`: largest distance along the plane that counts as near, m.
Contact contact(const PlaneTrack& small, const PlaneTrack& large, double gap);

/// Distance between the bounds of the areas along the larger plane, metres; 0 when they overlap.
double boundsGap(const PlaneTrack& small, const PlaneTrack& large);

/// Difference of the mean heights, m.
double heightDifference(const PlaneTrack& a, const PlaneTrack& b);

}  // namespace vip_slam
