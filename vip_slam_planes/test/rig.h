// SPDX-License-Identifier: BSD-3-Clause
// Test support: the whole plane module, with poses given as by a back end.
#pragma once

#include <cmath>
#include <map>
#include <memory>

#include "scene.h"
#include "vip_slam_planes/plane_mapper.h"

namespace vip_slam {
namespace testing {

class Rig {
 public:
  explicit Rig(double noise_scale = 1.0, PlaneMapperOptions options = {})
      : camera(testing::quietNoise(), noise_scale), mapper(options, camera.camera, camera.noise) {}
  explicit Rig(const DepthNoise& noise) : camera(noise, 1.0), mapper({}, camera.camera, noise) {}

  PlaneUpdate look(const Scene& scene, const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
    return place(camera.keyframe(scene, lookAt(eye, target)), lookAt(eye, target));
  }
  /// A keyframe that the back end places at T_W_C, which may differ from where it was taken.
  PlaneUpdate place(const std::shared_ptr<Keyframe>& keyframe, const SE3& T_W_C, const MapUpdate& base = {}) {
    mapper.addKeyframe(keyframe);
    MapUpdate update = updateFor(*keyframe, T_W_C);
    update.landmarks = base.landmarks;
    update.planes = base.planes;
    update.parts = base.parts;
    poses[keyframe->id] = T_W_C;
    return mapper.applyMapUpdate(update);
  }
  const PlaneEstimate* find(const Plane& truth, double max_d = 0.02) const {
    for (const PlaneEstimate& p : mapper.planes()) {
      if (p.plane.n.dot(truth.n) > std::cos(0.02) && std::abs(p.plane.d - truth.d) < max_d) return &p;
    }
    return nullptr;
  }

  /// Number of planes that face like `truth`, up to a few degrees, within max_d of it.
  int count(const Plane& truth, double max_d) const {
    int n = 0;
    for (const PlaneEstimate& p : mapper.planes()) {
      n += p.plane.n.dot(truth.n) > 0.99 && std::abs(p.plane.d - truth.d) < max_d;
    }
    return n;
  }

  SceneCamera camera;
  PlaneMapper mapper;
  std::map<KeyframeId, SE3> poses;
};

/// The planes of a loaded map as passed by the back end; keyframe `first` hosts them all.
inline std::vector<StoredPlane> storedPlanes(const std::vector<PlaneEstimate>& planes, std::uint32_t epoch = 0,
                                             KeyframeId first = 0, const SE3& T_map_C = {}) {
  std::vector<StoredPlane> stored;
  for (const PlaneEstimate& plane : planes) stored.push_back({plane, {first, epoch, T_map_C}});
  return stored;
}

inline Scene room() {
  Scene scene;
  scene.addRoom({-3, -2.5, 0}, {3, 2.5, 2.6});
  return scene;
}

}  // namespace testing
}  // namespace vip_slam
