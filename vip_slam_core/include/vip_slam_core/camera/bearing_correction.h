// What the intrinsics of a camera get wrong, in normalised coordinates: a bearing (x, y, 1) that they make of a pixel
// means (x + sx x + cx, y + sy y + cy, 1). A focal length that is given too long makes s positive, a principal point
// that is given too far right or down makes c positive. The map is linear in (x, y, 1), so that depth points follow it
// as they are: p -> (I + K) p. Through a lens with distortion that is right to a tenth of the correction; the filter,
// which sees a few hundredths of a pixel, takes each bearing's own Jacobian instead.
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

/// (fx, fy, cx, cy) in pixels that need no correction any more, instead of `given`.
inline Eigen::Vector4d correctedIntrinsics(const Eigen::Vector4d& given, const BearingCorrection& bearing) {
  const Eigen::Vector2d focal = given.head<2>().array() / (1.0 + bearing.value.head<2>().array());
  Eigen::Vector4d corrected;
  corrected << focal, given.tail<2>() - bearing.value.tail<2>().cwiseProduct(focal);
  return corrected;
}

}  // namespace vip_slam
