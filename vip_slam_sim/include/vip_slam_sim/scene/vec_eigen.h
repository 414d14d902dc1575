// SPDX-License-Identifier: BSD-3-Clause
// Conversions between the renderer's vectors and Eigen's.
#pragma once

#include <Eigen/Core>

#include "vip_slam_sim/scene/vec.h"

namespace vip_slam {

inline Vec3 toVec(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}
inline Eigen::Vector3d toEigen(const Vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace vip_slam
