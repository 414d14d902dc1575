// SPDX-License-Identifier: BSD-3-Clause
// The compressed point-to-plane measurement of one keyframe on one plane (paper section "Compressed Point-to-Plane
// Measurement"): samples spread evenly in 3D, G = s * sum p~ p~^T / sigma^2, with s for the error that they share.
// A wrong sample cannot be removed once it is summed, so the selection is strict: nodes one stride inside the surface's
// image region, near the plane at the corrected pose, and on the surface fitted to these nodes alone. The last test
// does not depend on the pose, so that it does not hide the pose error which the measurement has to correct.
#pragma once

#include <optional>
#include <vector>

#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/plane_map.h"
#include "vip_slam_planes/association/surface_labels.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

/// The depth points of each of `count` labels, in the camera frame: the nodes inside its image region and the features
/// in it. `rays` belong to the keyframe's depth grid.
std::vector<std::vector<Eigen::Vector3d>> pointsByLabel(const Keyframe& keyframe, const SurfaceLabels& labels,
                                                        const std::vector<Eigen::Vector2f>& rays, std::size_t count);

class PlaneSampler {
 public:
  PlaneSampler(const PlaneObservationOptions& options, double distance_gate, const DepthNoise& noise)
      : options_(options), distance_gate_(distance_gate), noise_(noise) {}

  /// One sigma of the distance along n_C of a depth point, without bias: sigma_z(z) |n.ray| / |ray.e_z|.
  double sigmaAlong(const Eigen::Vector3d& n_C, const Eigen::Vector3d& p_C) const;

  /// Samples of the points `shown` on a plane; empty when too few remain or they lie on another surface.
  std::optional<PlaneObservation> sample(KeyframeId keyframe, const std::vector<Eigen::Vector3d>& shown,
                                         const SE3& T_map_C, PlaneId plane_id, const Plane& plane) const;

  /// Computes observation->G from its samples with their sigmas along n_C; sets weight_scale.
  void accumulate(const Eigen::Vector3d& n_C, PlaneObservation* observation) const;

 private:
  std::vector<Eigen::Vector3d> spreadEvenly(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& n) const;
  bool keepLocalSurface(const Eigen::Vector3d& n_C, std::vector<Eigen::Vector3d>* points) const;

  PlaneObservationOptions options_;
  double distance_gate_;
  DepthNoise noise_;
};

}  // namespace vip_slam
