// SPDX-License-Identifier: BSD-3-Clause
// Applies corrections of depth and intrinsics that are estimated only after readings and bearings were passed on: all
// data derived from them is converted to the newest correction. A corrected reading moves its point along the ray; a
// corrected bearing rotates the ray. With a shift of the depth image, points on planes move sideways with their
// readings, while pixels of features and of the grid stay and get other readings.
#pragma once

#include <string>

#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// Message on what is wrong, empty when nothing is: not finite, or more than a camera can be off by.
std::string validateCameraCorrection(const CameraCorrection& correction);

/// The odometry's motion had its depth been longer by this factor: its displacement is as long as depth says.
RelativeMotion withDepthScale(const RelativeMotion& motion, double factor);

/// The keyframe with `correction` instead of its present correction of readings and bearings; the same object when they
/// are equal. Sigmas, pixels and the grid's layout, which is in pixels, stay.
KeyframePtr withCameraCorrection(const KeyframePtr& keyframe, const CameraCorrection& correction);

/// The same for depth points on a plane; G is recomputed from the points.
void setCameraCorrection(const CameraCorrection& correction, PlaneObservation* observation);

}  // namespace vip_slam
