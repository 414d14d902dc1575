// Landmarks on planes that were no variables: where their rays meet the plane.
#pragma once

#include <vector>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// Reads the map's poses as they are at the first use of each keyframe.
class PlaneIntersection {
 public:
  explicit PlaneIntersection(const Map& map);
  /// Robust weighted mean of where the rays of a landmark's observations meet the plane; the projection of its position
  /// when none does.
  Eigen::Vector3d operator()(const MapLandmark& landmark, const Plane& plane);
  /// Asks for the memory that a later call with this landmark will read.
  void prefetch(const MapLandmark& landmark);

 private:
  struct Camera {
    Eigen::Matrix3d R_W_C;
    Eigen::Vector3d t_W_C;
    const Feature* features;
  };
  const Camera& camera(KeyframeId id);  // until the next call

  struct Hit {
    Eigen::Vector3d p_W;
    double weight;
  };
  std::vector<Hit> hits_;  // of the landmark at hand
  const Map& map_;
  KeyframeId lowest_;
  std::vector<int> camera_of_;  // by keyframe - lowest_: keyframes lie close together in their ids
  std::vector<Camera> cameras_;
};

}  // namespace vip_slam
