// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/zero_velocity.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

namespace {

/// Whether the means agree within the noise of both.
bool restsAs(const ImuSpread& now, const ImuSpread& rest) {
  const double gate = kGateSigmas / std::sqrt(static_cast<double>(std::max<std::size_t>(1, now.count)));
  return (now.mean_gyro - rest.mean_gyro).norm() < gate * std::max(now.gyro_std, now.gyro_floor) &&
         (now.mean_accel - rest.mean_accel).norm() < gate * std::max(now.accel_std, now.accel_floor);
}

}  // namespace

bool ImuSpread::quiet(double max_gyro_std, double max_accel_std) const {
  return gyro_std < std::max(max_gyro_std, 1.4 * gyro_floor) && accel_std < std::max(max_accel_std, 1.4 * accel_floor);
}

ImuSpread imuSpread(const std::vector<ImuSample>& samples, const ImuNoise* noise) {
  ImuSpread spread;
  spread.count = samples.size();
  if (samples.empty()) return spread;
  for (const ImuSample& s : samples) {
    spread.mean_gyro += s.gyro;
    spread.mean_accel += s.accel;
  }
  spread.mean_gyro /= static_cast<double>(samples.size());
  spread.mean_accel /= static_cast<double>(samples.size());
  double gyro = 0, accel = 0;
  for (const ImuSample& s : samples) {
    gyro += (s.gyro - spread.mean_gyro).squaredNorm();
    accel += (s.accel - spread.mean_accel).squaredNorm();
  }
  spread.gyro_std = std::sqrt(gyro / samples.size());
  spread.accel_std = std::sqrt(accel / samples.size());
  const double seconds = samples.back().t - samples.front().t;
  if (noise && seconds > 0) {
    const double root = std::sqrt(3.0 * static_cast<double>(samples.size() - 1) / seconds);  // three axes
    spread.gyro_floor = noise->gyro_noise_density * root;
    spread.accel_floor = noise->accel_noise_density * root;
  }
  return spread;
}

bool StillnessDetector::update(const StillnessCues& cues) {
  const bool quiet = cues.imu.count >= 5 && cues.imu.quiet(options_.max_gyro_std, options_.max_accel_std);
  const bool unchanged = cues.imu.count >= 5 && restsAs(cues.imu, rest_), rests = quiet && unchanged;
  const bool image_known = cues.disparity_px >= 0 && cues.tracks > kEnough;
  const double moved_px = std::max(cues.disparity_px, cues.anchor_disparity_px);
  // The mean velocity over the window of an acceleration at the limit.
  residual_motion_ = {options_.max_gyro_std * kRestWindow, 0.5 * options_.max_accel_std * kRestWindow * kRestWindow};
  if (image_known && cues.px_per_metre > 0) {
    // The median over the tracks errs by as much as its noise.
    const double px = std::hypot(moved_px, cues.sigma_px / std::sqrt(static_cast<double>(cues.tracks)));
    residual_motion_ = {px / cues.px_per_radian, px / cues.px_per_metre};
  }
  // While still, an image without features (lights off) does not end the stillness; image motion does.
  const bool unmoved = image_known ? moved_px < kStillPixels : still_ && rests;
  const double sigma = std::hypot(cues.sigma_velocity, residual_motion_.translation / kRestWindow);
  const bool was_still = still_;
  still_ = options_.enabled && (quiet || (still_ && unchanged)) && unmoved && cues.speed < kGateSigmas * sigma;
  imu_rests_ = still_ || (imu_rests_ && rests);
  if (still_) {
    // The biases drift: a mean over the last images.
    const double share = was_still ? 1.0 / kEnough : 1.0;
    rest_.mean_gyro += share * (cues.imu.mean_gyro - rest_.mean_gyro);
    rest_.mean_accel += share * (cues.imu.mean_accel - rest_.mean_accel);
  }
  return still_;
}

void StillnessDetector::begin(const ImuSpread& rest) {
  still_ = imu_rests_ = options_.enabled;
  rest_ = rest;
}

double leastImageMotion(const std::vector<Eigen::Vector3d>& points, double focal) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  int count = 0;
  for (const Eigen::Vector3d& p : points) {
    if (!(p.z() > 0)) continue;
    Eigen::Matrix<double, 2, 3> J;
    J << 1.0, 0.0, -p.x() / p.z(), 0.0, 1.0, -p.y() / p.z();
    J *= focal / p.z();
    sum += J.transpose() * J;
    ++count;
  }
  if (count == 0) return 0;
  const double least =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum / count, Eigen::EigenvaluesOnly).eigenvalues()(0);
  return std::sqrt(std::max(0.0, least));
}

void zeroVelocityRows(const WindowState& window, int anchor, double dt, const ResidualMotion& residual_motion,
                      Eigen::MatrixXd* H, Eigen::VectorXd* h) {
  const int newest = static_cast<int>(window.clones.size()) - 1;
  const bool relative = anchor >= 0 && anchor != newest;
  const double root = std::sqrt(std::max(1.0, kRestWindow / dt));
  const double step = residual_motion.translation * root, turn = residual_motion.rotation * root;
  *H = Eigen::MatrixXd::Zero(relative ? 9 : 3, window.dimension());
  *h = Eigen::VectorXd::Zero(relative ? 9 : 3);
  const double wv = kRestWindow / step;
  H->block<3, 3>(0, window.navColumn()) = wv * Eigen::Matrix3d::Identity();
  h->head<3>() = -wv * window.v_W;
  if (!relative) return;

  const Clone& a = window.clones[anchor];
  const Clone& b = window.clones[newest];
  const double wr = 1.0 / turn, wp = 1.0 / step;
  // Log(R_a^T R_b) = 0 with theta right-perturbed on both: d = dtheta_b - R_b^T R_a dtheta_a for a small angle. The
  // translation is compared in the frame of a, which keeps yaw and position unobservable.
  const Eigen::Matrix3d Ra = a.T_W_I_fej.R(), Rb = b.T_W_I_fej.R();
  const Eigen::Vector3d rotation = logSO3(Eigen::Matrix3d(a.T_W_I.R().transpose() * b.T_W_I.R()));
  H->block<3, 3>(3, window.cloneColumn(newest)) = wr * Eigen::Matrix3d::Identity();
  H->block<3, 3>(3, window.cloneColumn(anchor)) = -wr * Rb.transpose() * Ra;
  h->segment<3>(3) = -wr * rotation;
  const Eigen::Vector3d d_fej = Ra.transpose() * (b.T_W_I_fej.t() - a.T_W_I_fej.t());
  H->block<3, 3>(6, window.cloneColumn(newest) + 3) = wp * Ra.transpose();
  H->block<3, 3>(6, window.cloneColumn(anchor) + 3) = -wp * Ra.transpose();
  H->block<3, 3>(6, window.cloneColumn(anchor)) = wp * hat(d_fej);
  h->tail<3>() = -wp * (a.T_W_I.R().transpose() * (b.T_W_I.t() - a.T_W_I.t()));
}

}  // namespace vip_slam
