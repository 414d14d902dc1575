// SPDX-License-Identifier: BSD-3-Clause
#include "odometry_factors.h"

#include <Eigen/Cholesky>

namespace vip_slam {
namespace {

// Smallest sigmas of an odometry factor, even for the shortest motion: rad, m.
constexpr double kMinRotation = 5e-5, kMinTranslation = 3e-4;

}  // namespace

Matrix6d leastCovariance(const Matrix6d& covariance) {
  Matrix6d least = covariance;
  least.diagonal().head<3>().array() += kMinRotation * kMinRotation;
  least.diagonal().tail<3>().array() += kMinTranslation * kMinTranslation;
  return least;
}

bool odometryFactor(const MapKeyframe& keyframe, int i, int j, const MeasurementOptions& options,
                    BaRelativePose* factor) {
  if (!options.use_odometry || !keyframe.motion.known()) return false;
  const Matrix6d information = leastCovariance(keyframe.motion.covariance).llt().solve(Matrix6d::Identity());
  const Eigen::LLT<Matrix6d> root(information);
  if (root.info() != Eigen::Success || !information.allFinite()) return false;
  factor->i = i;
  factor->j = j;
  factor->T_i_j = keyframe.motion.T_a_b;
  factor->sqrt_information = root.matrixU();
  return true;
}

}  // namespace vip_slam
