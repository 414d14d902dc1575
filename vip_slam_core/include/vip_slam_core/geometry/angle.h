// SPDX-License-Identifier: BSD-3-Clause
// Degrees, for people; everything computes in radians.
#pragma once

namespace vip_slam {

inline constexpr double kDegree = 3.14159265358979323846 / 180.0;  ///< rad

}  // namespace vip_slam
