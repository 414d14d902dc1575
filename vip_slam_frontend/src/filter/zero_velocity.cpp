// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/zero_velocity.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

namespace {

constexpr double kStillSpeed = 0.1;  // m/s, largest estimated one to stand still
// Still images in a row to enter, moving ones to leave.
constexpr int kImagesIn = 4, kImagesOut = 2;
// One sigma of zero velocity, m/s, and of zero rotation, rad, and translation, m, since stopping.
constexpr double kZeroVelocity = 0.02, kZeroRotation = 0.0017, kZeroPosition = 0.002;
// The sigmas stop growing after this many repeats; else the IMU's noise would make the standing pose drift.
constexpr int kMaxRepeats = 8;
// Without an image, the IMU's means may differ from those at rest by this much (or five sigmas of their noise), ...
constexpr double kMaxGyroShift = 0.005;  // rad/s
constexpr double kMaxAccelShift = 0.05;  // m/s^2
// ... and those at rest follow by this share of the difference per image, since the biases drift.
constexpr double kRestFollows = 0.01;
// Number of images after standing still from which on slow motion may have begun unnoticed by the IMU.
constexpr int kForgotten = 40;
// Factor from image motion over its limit to the factor on the zero-velocity sigmas. The configured sigmas fit image
// motion at the limit for surfaces about two metres away; kFar allows for three times that distance. However little the
// image moves, the sigmas do not fall below the share kMinResidualMotion.
constexpr double kFar = 3.0, kMinResidualMotion = 0.2;
// Image motion per metre of translation, px/m, from which on the limits on image motion hold unchanged: 0.8 px for a
// centimetre. Where a translation shows less the limits are lower in proportion, down to the share kMinLimit (noise).
constexpr double kPxPerMetre = 80.0, kMinLimit = 0.2;

bool restsAs(const ImuSpread& now, const ImuSpread& rest) {
  const double root = std::sqrt(static_cast<double>(std::max<std::size_t>(1, now.count)));
  return (now.mean_gyro - rest.mean_gyro).norm() < std::max(kMaxGyroShift, 5.0 * now.gyro_floor / root) &&
         (now.mean_accel - rest.mean_accel).norm() < std::max(kMaxAccelShift, 5.0 * now.accel_floor / root);
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

std::vector<ImuSample> movingMeans(const std::vector<ImuSample>& samples, double seconds) {
  std::vector<ImuSample> means;
  ImuSample sum;
  std::size_t first = 0, count = 0;  // of those in the sum
  std::size_t next = 0;
  for (const ImuSample& middle : samples) {
    if (middle.t - samples.front().t < 0.5 * seconds) continue;
    if (samples.back().t - middle.t < 0.5 * seconds) break;
    for (; next < samples.size() && samples[next].t <= middle.t + 0.5 * seconds; ++next, ++count) {
      sum.gyro += samples[next].gyro;
      sum.accel += samples[next].accel;
    }
    for (; samples[first].t < middle.t - 0.5 * seconds; ++first, --count) {
      sum.gyro -= samples[first].gyro;
      sum.accel -= samples[first].accel;
    }
    means.push_back({middle.t, sum.gyro / static_cast<double>(count), sum.accel / static_cast<double>(count)});
  }
  return means;
}

bool StillnessDetector::update(const StillnessCues& cues) {
  const auto quiet = [this](const ImuSpread& spread) {
    return spread.count >= 5 && spread.quiet(options_.max_gyro_std, options_.max_accel_std);
  };
  const bool rests = quiet(cues.imu);
  const bool image_known = cues.disparity_px >= 0 && cues.tracks > kEnough;
  const double shows = cues.px_per_metre > 0 ? cues.px_per_metre / kPxPerMetre : 1.0;
  const double limit = kStillPixels * std::clamp(shows, kMinLimit, 1.0);
  bool wants = options_.enabled && (rests || (image_known && quiet(cues.unshaken))) && cues.speed < kStillSpeed;
  if (still_) {
    // While still, an image without features (lights off) does not end the stillness; image motion does.
    wants = wants && (image_known ? cues.disparity_px < 1.5 * limit : restsAs(cues.imu, rest_)) &&
            cues.anchor_disparity_px < 3.0 * limit;
  } else {
    wants = wants && image_known && cues.disparity_px < limit;
  }
  residual_motion_ = {};
  if (image_known) {
    const double moved = kFar * std::max(cues.disparity_px, cues.anchor_disparity_px);
    residual_motion_.rotation = std::max(kMinResidualMotion, moved / kStillPixels);
    residual_motion_.translation = std::max(kMinResidualMotion, moved / limit);
  }
  if (wants) {
    const double share = image_known ? 1.0 : kRestFollows;
    rest_.mean_gyro += share * (cues.imu.mean_gyro - rest_.mean_gyro);
    rest_.mean_accel += share * (cues.imu.mean_accel - rest_.mean_accel);
  }
  if (wants == still_) {
    in_a_row_ = 0;
  } else if (++in_a_row_ >= (still_ ? kImagesOut : kImagesIn)) {
    still_ = wants;
    in_a_row_ = 0;
  }
  since_still_ = still_ ? 0 : std::min(since_still_ + 1, kForgotten);
  imu_rests_ = rests && since_still_ < kForgotten && restsAs(cues.imu, rest_);
  // A single image with motion already suspends the updates; it takes kImagesIn images to start them.
  return still_ && wants;
}

void StillnessDetector::begin(const ImuSpread& rest) {
  still_ = options_.enabled;
  in_a_row_ = since_still_ = 0;
  rest_ = rest;
}

void StillnessDetector::reset() {
  still_ = imu_rests_ = false;
  in_a_row_ = 0;
  since_still_ = kForgotten;
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

void zeroVelocityRows(const WindowState& window, int anchor, int repeats, const ResidualMotion& residual_motion,
                      Eigen::MatrixXd* H, Eigen::VectorXd* h) {
  const int newest = static_cast<int>(window.clones.size()) - 1;
  const bool relative = anchor >= 0 && anchor != newest;
  const double root = std::sqrt(1.0 + std::min(repeats, kMaxRepeats));
  const double step = residual_motion.translation * root, turn = residual_motion.rotation * root;
  *H = Eigen::MatrixXd::Zero(relative ? 9 : 3, window.dimension());
  *h = Eigen::VectorXd::Zero(relative ? 9 : 3);
  const double wv = 1.0 / (kZeroVelocity * step);
  H->block<3, 3>(0, window.navColumn()) = wv * Eigen::Matrix3d::Identity();
  h->head<3>() = -wv * window.v_W;
  if (!relative) return;

  const Clone& a = window.clones[anchor];
  const Clone& b = window.clones[newest];
  const double wr = 1.0 / (kZeroRotation * turn), wp = 1.0 / (kZeroPosition * step);
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
