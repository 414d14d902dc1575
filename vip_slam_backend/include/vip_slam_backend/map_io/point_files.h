// The map's points for other programs; coordinates in `map`, metres; `plane` is the plane a point lies on, 0 for none.
#pragma once

#include <string>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// ASCII PLY with x y z plane. Whole or not at all; throws std::runtime_error naming the path.
void writePointsPly(const std::string& path, const Map& map);
/// ASCII PCD 0.7 with x y z label.
void writePointsPcd(const std::string& path, const Map& map);

}  // namespace vip_slam
