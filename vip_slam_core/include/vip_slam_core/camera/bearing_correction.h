// SPDX-License-Identifier: BSD-3-Clause
// Correction of a camera's intrinsics in normalised coordinates: the true bearing of a pixel is (x + sx x + cx, y + sy
// y + cy, 1), where (x, y, 1) is the one computed with the given intrinsics. s is positive when the given focal length
// is too long, c when the given principal point is too far right or down. The map is linear in (x, y, 1), so that it
// applies to depth points as well: p -> (I + K) p. For a lens with distortion that is accurate to a tenth of the
// correction; the filter, which resolves a few hundredths of a pixel, uses each bearing's own Jacobian.
#pragma once

#include <Eigen/Core>

namespace vip_slam {

struct BearingCorrection {
  /// (sx, sy, cx, cy), no units.
  Eigen::Vector4d value = Eigen::Vector4d::Zero();

  template <typename Scalar>
  Eigen::Matrix<Scalar, 2, 1> operator()(const Eigen::Matrix<Scalar, 2, 1>& xy) const {
    const Eigen::Matrix<Scalar, 4, 1> v = value.cast<Scalar>();
    return xy + v.template head<2>().cwiseProduct(xy) + v.template tail<2>();
  }
  /// I + K.
  Eigen::Matrix3d matrix() const {
    Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
    m.diagonal().head<2>() += value.head<2>();
    m.col(2).head<2>() += value.tail<2>();
    return m;
  }
  bool operator==(const BearingCorrection& other) const { return value == other.value; }
  bool operator!=(const BearingCorrection& other) const { return value != other.value; }
};

/// Intrinsics (fx, fy, cx, cy), pixels, that include the correction; to be used instead of `given` without it.
inline Eigen::Vector4d correctedIntrinsics(const Eigen::Vector4d& given, const BearingCorrection& bearing) {
  const Eigen::Vector2d focal = given.head<2>().array() / (1.0 + bearing.value.head<2>().array());
  Eigen::Vector4d corrected;
  corrected << focal, given.tail<2>() - bearing.value.tail<2>().cwiseProduct(focal);
  return corrected;
}

}  // namespace vip_slam
