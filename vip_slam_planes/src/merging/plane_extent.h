// Relative position of two planes' areas: contact, distance, continuation, heights, and other planes beyond them.
#pragma once

#include <vector>

#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

/// m^2; smaller walls may be furniture.
constexpr double kLargeWall = 1.0;

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

/// The length of the larger plane when it is a long strip and the smaller one continues it between the same two edges;
/// else 0.
double lengthIfContinued(const PlaneTrack& small, const PlaneTrack& large);

/// Difference of the mean heights, m.
double heightDifference(const PlaneTrack& a, const PlaneTrack& b);

/// Whether walls end at both pieces and no known plane next to or between them lies beyond: above a duct or a beam the
/// walls continue, and so they do below a table. For a floor no known plane at all may lie below.
bool outermost(const PlaneTrack& a, const PlaneTrack& b, const std::vector<const PlaneTrack*>& known);

}  // namespace vip_slam
