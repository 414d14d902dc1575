// SPDX-License-Identifier: BSD-3-Clause
// What one keyframe's depth measures of each plane that it shows.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "vip_slam_planes/association/plane_sampler.h"
#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/mesh/depth_mesh.h"

namespace vip_slam::planes {

class PlaneObserver {
 public:
  PlaneObserver(const PlaneMapperOptions& options, const std::shared_ptr<const CameraModel>& camera,
                const DepthNoise& noise)
      : rays_(camera), sampler_(options.observation, options.growth.distance, noise) {}

  /// One entry per plane; `labels` are indices of them. Empty where the keyframe shows too little of a plane, or
  /// another surface.
  std::vector<std::optional<PlaneObservation>> observe(const Keyframe& keyframe, const SE3& T_map_C,
                                                       const SurfaceLabels& labels,
                                                       const std::vector<PlaneTrack*>& planes) {
    const CameraCorrection& correction = keyframe.frame.camera_correction;
    const auto shown =
        pointsByLabel(keyframe, labels, rays_(keyframe.frame.depth_grid, correction.bearing), planes.size());
    std::vector<std::optional<PlaneObservation>> observations;
    for (std::size_t k = 0; k < planes.size(); ++k) {
      observations.push_back(sampler_.sample(keyframe.id, shown[k], T_map_C, planes[k]->id(), planes[k]->plane()));
      if (observations.back()) observations.back()->camera_correction = correction;
    }
    return observations;
  }

 private:
  GridRays rays_;  ///< of the last keyframe's grid
  PlaneSampler sampler_;
};

}  // namespace vip_slam::planes
