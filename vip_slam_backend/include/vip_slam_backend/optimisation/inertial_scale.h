// Whether the map is as large as the accelerometer says. A map's distances come from depth, by way of tens of thousands
// of readings; the accelerometer, which measures in metres per second squared, has next to no say in them. What it says
// is asked here: the keyframes' poses are held as they are but for one common factor on their distances, and
// velocities, biases, the direction of gravity and its magnitude are free.
#pragma once

#include <string>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map/map_snapshot.h"
#include "vip_slam_core/sensor/sensor_config.h"

namespace vip_slam {

/// From all keyframes on the IMU chain but those of stored maps. `gravity` in m/s^2 is believed to 0.2 %, which is how
/// it differs between places. Unknown with less than ten seconds of IMU, or
/// when the motion does not show it to one per cent.
InertialScale inertialScale(const Map& map, double gravity, const ImuNoise& noise);

/// What to tell the user when depth and accelerometer contradict each other beyond doubt (five sigmas) and by enough to
/// matter (half a percent); empty else. `sensor` has the scale that is in use; depth in 32FC1 has none.
std::string scaleDifference(const InertialScale& scale, const SensorConfig& sensor);

}  // namespace vip_slam
