// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/initialisation/initialiser.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_frontend/filter/zero_velocity.h"

namespace vip_slam {

namespace {

// One sigma of the velocity by the motion between the first images, m/s. (A phone, real: 1.36 cm; with 0.45 it
// is 1.55.)
constexpr double kVelocityByImages = 0.15;

}  // namespace

void startAtBase(const SE3& T_base_imu, FilterPrior* prior) {
  if (T_base_imu.boxminus(SE3()).norm() < 1e-9) return;
  const SE3 T_W_base = prior->state.T_W_I * T_base_imu.inverse();
  const Eigen::Vector3d up_base = T_W_base.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  const SE3 turn = alignLevelled(SE3(gravityAlignedRotation(up_base), Eigen::Vector3d::Zero()), T_W_base);
  prior->state.T_W_I = turn * prior->state.T_W_I;
  prior->state.v_W = turn.rotation() * prior->state.v_W;
}

Initialiser::Initialiser(const InitialisationOptions& options, const FilterOptions& filter, const ImuNoise& noise,
                         const SE3& T_I_C, double gravity)
    : options_(options), filter_(filter), noise_(noise), T_I_C_(T_I_C), gravity_(gravity) {}

void Initialiser::reset() {
  images_.clear();
  reason_ = "waiting for images and IMU";
}

std::optional<FilterPrior> Initialiser::standing(double t, const frontend::InertialInput& inertial) {
  const double from = t - kStandingSeconds;
  if (!inertial.complete() || inertial.oldest() > from) return std::nullopt;
  const std::vector<ImuSample> samples = inertial.between(from, t);
  if (samples.size() < kEnough) return std::nullopt;
  const ImuSpread spread = imuSpread(samples, &noise_);
  if (!spread.quiet(filter_.zupt.max_gyro_std, filter_.zupt.max_accel_std) ||
      spread.mean_gyro.norm() > kGateSigmas * filter_.sigma_bias_gyro)
    return std::nullopt;
  level_ = frontend::Level::kAccelerometer;
  FilterPrior prior;
  prior.standing = prior.at_rest = true;
  prior.state.t = t;
  prior.state.T_W_I = SE3(gravityAlignedRotation(spread.mean_accel), Eigen::Vector3d::Zero());
  prior.state.bias_gyro = spread.mean_gyro;
  prior.sigma_tilt = 0.3;
  prior.sigma_velocity = 0.02;
  prior.sigma_bias_accel = filter_.sigma_bias_accel;
  const double inflation = 2.0, root = std::sqrt(kStandingSeconds);
  prior.sigma_bias_gyro = std::min(
      filter_.sigma_bias_gyro, 2e-4 + inflation * (noise_.gyro_noise_density / root + noise_.gyro_random_walk * root));
  prior.sigma_mean_accel = 0.005 + inflation * (noise_.accel_noise_density / root + noise_.accel_random_walk * root);
  return prior;
}

std::optional<FilterPrior> Initialiser::add(const InitialisationInput& image, const frontend::InertialInput& inertial) {
  const double t = image.t_imu;
  const bool usable = image.points >= options_.min_points || image.surfaces;
  if (!usable) {
    images_.clear();
    reason_ = formatted("sees %d points with depth and no surfaces, needs %d (initialisation/min_points) or surfaces",
                        image.points, options_.min_points);
    return standing(t, inertial);
  }
  images_.push_back(image);
  while (images_.size() > 2 && t - images_.front().t_imu > 2 * options_.seconds) images_.pop_front();
  const double seconds = t - images_.front().t_imu;
  if (seconds < options_.seconds) {
    reason_ = formatted("gathering %.2f s of images", options_.seconds);
    return std::nullopt;
  }
  const double from = inertial.complete() ? std::max(t - kStandingSeconds, inertial.oldest()) : t - seconds;
  const std::vector<ImuSample> samples = inertial.between(from, t);
  if (inertial.complete() && samples.size() < 2) {
    reason_ = "waiting for the IMU";
    return std::nullopt;
  }

  // The camera's motion over the gathered images.
  SE3 T_first_last;
  bool seen = true;
  for (std::size_t k = 1; k < images_.size(); ++k) {
    seen = seen && images_[k].T_current_previous.has_value();
    if (seen) T_first_last = T_first_last * images_[k].T_current_previous->inverse();
  }
  const SE3 T_I0_I = T_I_C_ * T_first_last * T_I_C_.inverse();
  const Eigen::Vector3d rate = logSO3(T_I0_I.R()) / seconds;  // of the body, rad/s

  FilterPrior prior;
  prior.state.t = t;
  // Level: up is where the specific force points, in the body as it is oriented now.
  Eigen::Vector3d up = T_I_C_.R() * image.up.value_or(-Eigen::Vector3d::UnitY());
  prior.sigma_tilt = prior.sigma_position;  // without an accelerometer part of the gauge
  accelerometer_fault_.clear();
  ImuSpread spread;
  double slow = 0;
  if (inertial.hasAccel()) {
    spread = imuSpread(samples, &noise_);
    // A slow acceleration does not show as a scatter, and may be as large as the scatter of a standing body.
    slow = filter_.zupt.max_accel_std;
    if (spread.quiet(filter_.zupt.max_gyro_std, filter_.zupt.max_accel_std) &&
        std::abs(spread.mean_accel.norm() - gravity_) > kGateSigmas * std::hypot(filter_.sigma_bias_accel, slow)) {
      accelerometer_fault_ = formatted("the accelerometer reads %.2f at rest, expected %.2f m/s^2: is its unit right?",
                                       spread.mean_accel.norm(), gravity_);
    }
  }
  const bool by_accelerometer = inertial.hasAccel() && accelerometer_fault_.empty();
  level_ = by_accelerometer ? frontend::Level::kAccelerometer
           : image.up       ? frontend::Level::kFloor
                            : frontend::Level::kCamera;
  if (by_accelerometer) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d R_now_then = Eigen::Matrix3d::Identity();
    for (std::size_t k = samples.size(); k-- > 0;) {
      if (k + 1 < samples.size()) {
        const double dt = samples[k + 1].t - samples[k].t;
        const Eigen::Vector3d omega =
            inertial.hasGyro() ? Eigen::Vector3d(0.5 * (samples[k].gyro + samples[k + 1].gyro)) : rate;
        R_now_then = R_now_then * expSO3(Eigen::Vector3d(-omega * dt));
      }
      sum += R_now_then * samples[k].accel;
    }
    up = sum;
    if (inertial.hasGyro()) {
      prior.standing = true;  // tilt and accelerometer bias have to agree with this mean
      prior.sigma_tilt = 0.3;
      prior.sigma_mean_accel = std::hypot(slow, spread.accel_std);
    }
  }
  // Where images alone carry the motion on, nothing tells the tilt any more, nor a bias.
  prior.sigma_bias_accel = inertial.complete() ? filter_.sigma_bias_accel : prior.sigma_position;
  prior.state.T_W_I = SE3(gravityAlignedRotation(up), Eigen::Vector3d::Zero());
  // Mean over the gathered images, in the present orientation; else that of a body which moves to and fro.
  prior.sigma_velocity = seen ? kVelocityByImages : frontend::kBodyAcceleration / frontend::kBodyFrequency;
  if (seen) prior.state.v_W = prior.state.T_W_I.R() * (T_I0_I.R().transpose() * T_I0_I.t()) / seconds;
  prior.sigma_bias_gyro = inertial.hasGyro() ? filter_.sigma_bias_gyro : prior.sigma_position;
  if (inertial.hasGyro() && seen) {
    // A bias that is larger than its prior allows shows against the images.
    const Eigen::Vector3d off = imuSpread(inertial.between(images_.front().t_imu, t)).mean_gyro - rate;
    if (off.norm() > kGateSigmas * filter_.sigma_bias_gyro) prior.state.bias_gyro = off;
  }
  return prior;
}

}  // namespace vip_slam
