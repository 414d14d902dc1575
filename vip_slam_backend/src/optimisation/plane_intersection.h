// SPDX-License-Identifier: BSD-3-Clause
// Positions of landmarks on planes that were no variables: intersections of their rays with the plane.
#pragma once

#include <vector>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// Reads each keyframe's pose from the map at its first use, and keeps it.
class PlaneIntersection {
 public:
  explicit PlaneIntersection(const Map& map);
  /// Robust weighted mean of the intersections of a landmark's rays with the plane; the projection of its position when
  /// no ray intersects.
  Eigen::Vector3d operator()(const MapLandmark& landmark, const Plane& plane);
  /// Prefetches the memory that a later call with this landmark will read.
  void prefetch(const MapLandmark& landmark);

 private:
  struct Camera {
    Eigen::Matrix3d R_W_C;
    Eigen::Vector3d t_W_C;
    const Feature* features;
  };
  const Camera& camera(KeyframeId id);  // valid until the next call

  struct Hit {
    Eigen::Vector3d p_W;
    double weight;
  };
  std::vector<Hit> hits_;  // of the present landmark
  const Map& map_;
  KeyframeId lowest_;
  std::vector<int> camera_of_;  // by keyframe - lowest_, since keyframe ids are dense
  std::vector<Camera> cameras_;
};

}  // namespace vip_slam
