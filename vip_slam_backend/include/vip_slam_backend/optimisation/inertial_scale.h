// SPDX-License-Identifier: BSD-3-Clause
// Estimates the map's scale from the accelerometer alone, as a check. A map's distances come from tens of thousands of
// depth readings, and the accelerometer has hardly any weight against them. Here the keyframes' poses are fixed except
// for one common factor on their distances, and velocities, biases, the direction of gravity and its magnitude are
// free.
#pragma once

#include <string>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map/map_snapshot.h"
#include "vip_slam_core/sensor/sensor_config.h"

namespace vip_slam {

/// From all keyframes on the IMU chain but those of stored maps. `gravity`, m/s^2, has a prior sigma of 0.2 %, its
/// variation between places. Unknown where its sigma is above a third.
InertialScale inertialScale(const Map& map, double gravity, const ImuNoise& noise);

/// Whether the scale is off by so much that it is no matter of calibration, but of a wrong unit: significantly (three
/// sigmas) and by more than five per cent.
bool isLarge(const InertialScale& scale);

/// Message to the user when depth and accelerometer contradict each other by that much; empty otherwise. Less is learnt
/// and corrected for by the front end. `sensor` has the unit of depth in use.
std::string scaleDifference(const InertialScale& scale, const SensorConfig& sensor);

}  // namespace vip_slam
