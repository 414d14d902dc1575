// SPDX-License-Identifier: BSD-3-Clause
#include "odometry_factors.h"

#include <Eigen/Cholesky>

namespace vip_slam {
namespace {

// Smallest sigmas of an odometry factor, even for the shortest motion: rad, m.
constexpr double kMinRotation = 5e-5, kMinTranslation = 3e-4;

}  // namespace

bool odometryFactor(const MapKeyframe& keyframe, int i, int j, const MeasurementOptions& options,
                    BaRelativePose* factor) {
  if (!options.use_odometry || !keyframe.motion.known()) return false;
  Matrix6d covariance = keyframe.motion.covariance;
  covariance.diagonal().head<3>().array() += kMinRotation * kMinRotation;
  covariance.diagonal().tail<3>().array() += kMinTranslation * kMinTranslation;
  const Matrix6d information = covariance.llt().solve(Matrix6d::Identity());
  const Eigen::LLT<Matrix6d> root(information);
  if (root.info() != Eigen::Success || !information.allFinite()) return false;
  factor->i = i;
  factor->j = j;
  factor->T_i_j = keyframe.motion.T_a_b;
  factor->sqrt_information = root.matrixU();
  return true;
}

}  // namespace vip_slam
