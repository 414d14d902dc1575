// How much more than they are told to the pixels of tracks are off, as the map tells: by how much they miss the
// landmarks that it has by now. Told are the noise of the image and of the matching alone. A camera whose lens or
// readout is not quite as configured, or whose depth is of another moment, makes errors of a few tenths of a pixel that
// the views of a track share, and a map that takes them for noise of a tenth believes its pixels far above its depth.
#pragma once

#include <string>
#include <vector>

#include "landmark_views.h"
#include "vip_slam_backend/factors/frame_geometry.h"

namespace vip_slam {

/// Factor on the sigmas of all views, 1 to 8; 1 unless the views of a track miss each other by clearly more than told,
/// or when too few tracks say anything. Then it is by how much they miss the map. `frames`: the problem's, at the map's
/// present estimate.
double trackNoiseFactor(const LandmarkViews& views, const std::vector<FrameGeometry>& frames);

/// What to tell the user of such a factor; empty at 1.
std::string trackNoiseDifference(double factor);

}  // namespace vip_slam
