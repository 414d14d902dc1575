// Embree behind a small face: rays in, distances and pieces out.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "vip_slam_sim/scene/scene.h"

namespace vip_slam {

/// Rays and hits as structures of arrays. Directions need no unit length: t counts in their lengths.
struct RayBatch {
  std::vector<float> ox, oy, oz, dx, dy, dz, t;  ///< t: in the farthest distance, out the hit
  std::vector<int> piece;                        ///< out: -1 for none
  void resize(std::size_t n);
  std::size_t size() const { return t.size(); }
  void set(std::size_t i, const Vec3& o, const Vec3& d, float far = 1e30f);
};

/// Thread-safe after construction.
class RayTracer {
 public:
  /// Throws std::runtime_error with Embree's words when it refuses.
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
