// SPDX-License-Identifier: BSD-3-Clause
#include "imu_agreement.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace vip_slam {
namespace {

// Limit of the normalised squared residual per degree of freedom: in sequences without faults it is 0.5 in the median,
// 3 at the 95th percentile and 11 at most, except for the first keyframes of an odometry.
constexpr double kBelievable = 25.0;

// Covariance of the odometry's state without position: the absolute position is not known, but cancels in the relative
// motion of the two keyframes.
Matrix15d stateCovariance(const Keyframe& keyframe) {
  Matrix15d P = keyframe.frame.covariance;
  P.middleRows<3>(3).setZero();
  P.middleCols<3>(3).setZero();
  return P;
}

}  // namespace

double imuNoiseFactor(const MapKeyframe& previous, const MapKeyframe& keyframe, const Eigen::Vector3d& G) {
  if (!keyframe.preintegration) return 1.0;
  Matrix15d J_i, J_j;
  const Eigen::Matrix<double, 9, 1> off =
      keyframe.preintegration->residual(previous.data->frame.state, keyframe.data->frame.state, G, &J_i, &J_j, false)
          .head<9>();
  const Matrix15d S = keyframe.preintegration->covariance() + J_i * stateCovariance(*previous.data) * J_i.transpose() +
                      J_j * stateCovariance(*keyframe.data) * J_j.transpose();
  const double square = off.dot(S.topLeftCorner<9, 9>().ldlt().solve(off)) / 9.0;
  return std::isfinite(square) ? std::sqrt(std::max(1.0, square / kBelievable)) : 1.0;
}

}  // namespace vip_slam
