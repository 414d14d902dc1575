// SPDX-License-Identifier: BSD-3-Clause
// A small interface to Embree: takes rays, returns distances and the pieces hit.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "vip_slam_sim/scene/scene.h"

namespace vip_slam {

/// Rays and hits as a structure of arrays. Directions need not have unit length: t is in units of their length.
struct RayBatch {
  std::vector<float> ox, oy, oz, dx, dy, dz, t;  ///< t, in: greatest distance; out: distance of the hit
  std::vector<int> piece;                        ///< out: -1 for none
  void resize(std::size_t n);
  std::size_t size() const { return t.size(); }
  void set(std::size_t i, const Vec3& o, const Vec3& d, float far = 1e30f);
};

/// Thread-safe after construction.
class RayTracer {
 public:
  /// Throws std::runtime_error with Embree's message when it fails.
  explicit RayTracer(const Scene& scene);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  /// First hits beyond `near`. `coherent`: neighbouring rays point the same way.
  void intersect(RayBatch* rays, std::size_t n, float near, bool coherent) const;
  /// Distance from a point to the nearest surface, at most `radius`.
  float clearance(const Vec3& point, float radius) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vip_slam
