// SPDX-License-Identifier: BSD-3-Clause
// Small float vectors for the renderer's inner loops, used in place of Eigen.
#pragma once

#include <cmath>

namespace vip_slam {

/// Four floats in one register (r, g, b, spare).
using Vec4 = float __attribute__((vector_size(16)));

inline Vec4 splat(float v) { return Vec4{v, v, v, v}; }
inline Vec4 rgb(float r, float g, float b) { return Vec4{r, g, b, 1.f}; }

struct Vec3 {
  float x = 0, y = 0, z = 0;
};
inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(const Vec3& a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalised(const Vec3& a) { return a * (1.f / length(a)); }

}  // namespace vip_slam
