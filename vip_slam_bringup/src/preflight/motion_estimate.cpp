// SPDX-License-Identifier: BSD-3-Clause
// Camera-IMU delay and rotation from the motion: the gyro and the images see the same rotation.
//   gyro(t + td) = R_I_C rate_C(t) + b
// For each delay in a grid, R and b by orthogonal Procrustes; the delay with the smallest residual is taken. Two
// rounds: with wide bounds on the error of a step, then with bounds from the errors of the first round.
#include <algorithm>
#include <cmath>

#include <Eigen/SVD>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/gyro_integral.h"
#include "vip_slam_bringup/preflight/readout.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

struct Fit {
  double residual = 0, variance = 0, scale = 1;  ///< residual and variance: mean squares of the gyro side
  double median_error = 0;                       ///< rad/s
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d camera_variances = Eigen::Vector3d::Zero();  ///< descending
  std::size_t count = 0;
};

/// A step with an error above `floor + share * its rate` is due to blur, a moving object or a mismatch: its error is
/// capped at that bound, and later rounds fit without it. The bound hardly depends on the delay, so that residuals of
/// different delays are comparable.
struct Bound {
  double floor, share;  ///< rad/s, -
};

Fit fitRotation(const std::vector<RotationStep>& steps, const GyroIntegral& gyro, double offset, const Bound& limit) {
  std::vector<Eigen::Vector3d> imu, camera;
  for (const RotationStep& s : steps) {
    if (!gyro.covers(s.t0 + offset) || !gyro.covers(s.t1 + offset)) continue;
    imu.push_back((gyro.at(s.t1 + offset) - gyro.at(s.t0 + offset)) / (s.t1 - s.t0));
    camera.push_back(s.rate_C);
  }
  Fit fit;
  fit.count = imu.size();
  if (imu.size() < 20) return fit;
  std::vector<bool> use(imu.size(), true);
  for (int round = 0; round < 3; ++round) {
    Eigen::Vector3d mean_imu = Eigen::Vector3d::Zero(), mean_camera = Eigen::Vector3d::Zero();
    double n = 0;
    for (std::size_t i = 0; i < imu.size(); ++i) {
      if (!use[i]) continue;
      mean_imu += imu[i];
      mean_camera += camera[i];
      n += 1;
    }
    mean_imu /= n;
    mean_camera /= n;
    Eigen::Matrix3d cross = Eigen::Matrix3d::Zero(), spread = Eigen::Matrix3d::Zero();
    double variance = 0;
    for (std::size_t i = 0; i < imu.size(); ++i) {
      if (!use[i]) continue;
      const Eigen::Vector3d a = imu[i] - mean_imu, b = camera[i] - mean_camera;
      cross += a * b.transpose() / n;
      spread += b * b.transpose() / n;
      variance += a.squaredNorm() / n;
    }
    fit.R = nearestRotation(cross);
    fit.camera_variances = Eigen::JacobiSVD<Eigen::Matrix3d>(spread).singularValues();
    fit.scale = fit.camera_variances.sum() > 0 ? std::sqrt(variance / fit.camera_variances.sum()) : 1;
    fit.variance = variance;
    fit.residual = 0;
    std::vector<double> errors;
    for (std::size_t i = 0; i < imu.size(); ++i) {
      errors.push_back((imu[i] - mean_imu - fit.R * (camera[i] - mean_camera)).norm());
      const double bound = limit.floor + limit.share * (imu[i] - mean_imu).norm();
      use[i] = errors.back() <= bound;
      fit.residual += std::min(errors.back(), bound) * std::min(errors.back(), bound) / double(imu.size());
    }
    fit.median_error = upperMedian(errors);
    if (std::count(use.begin(), use.end(), true) < 10) break;
  }
  return fit;
}

constexpr double kUsefulReadout = 0.003;  // largest sigma of a readout that is used, seconds
constexpr double kStep = 0.002;           // of the grid of delays, seconds

struct Search {
  Fit fit;
  double offset = 0;
  double sigma = 0;     ///< of the offset, from the curvature of the residual; seconds
  bool at_end = false;  ///< of the range, so that there is no best one in it
};

/// The best delay within `range` of `middle`; false when gyro and images never overlap.
bool search(const std::vector<RotationStep>& steps, const GyroIntegral& gyro, double middle, double range,
            const Bound& limit, Search* out) {
  const int half = static_cast<int>(std::lround(range / kStep));
  std::vector<Fit> fits;
  for (int i = -half; i <= half; ++i) fits.push_back(fitRotation(steps, gyro, middle + i * kStep, limit));
  int best = -1;
  for (int i = 0; i < static_cast<int>(fits.size()); ++i)
    if (fits[i].count >= 40 && (best < 0 || fits[i].residual < fits[best].residual)) best = i;
  if (best < 0) return false;
  out->fit = fits[best];
  out->offset = middle + (best - half) * kStep;
  out->at_end = best == 0 || best + 1 == static_cast<int>(fits.size());
  if (!out->at_end) {
    const double a = fits[best - 1].residual, b = out->fit.residual, c = fits[best + 1].residual, curve = a - 2 * b + c;
    if (curve > 0) {
      out->offset += kStep * 0.5 * (a - c) / curve;
      // The residual is a mean over n steps of three components: the variance of one component is b / 3, and the second
      // derivative of the residual is twice the mean square of the change per second of delay.
      out->sigma = std::sqrt(2.0 / 3.0 * b * kStep * kStep / (curve * double(out->fit.count)));
    }
  }
  return true;
}

/// Gyro rate over image rate: of the mean over half a second, and of what is left. The gyro's noise is the smaller one:
/// images are regressed on it, so that their noise does not make the gain smaller.
/// `found`: delay and rotation.
void gainsOf(const std::vector<RotationStep>& steps, const GyroIntegral& gyro, const ReadoutEstimate& found,
             MotionEstimate* out) {
  constexpr double kBlock = 0.5;
  struct Pair {
    Eigen::Vector3d imu, camera;
  };
  std::vector<std::vector<Pair>> blocks;
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t begin = 0; begin < steps.size();) {
    std::vector<Pair> block;
    std::size_t end = begin;
    for (; end < steps.size() && steps[end].t1 - steps[begin].t0 < kBlock; ++end) {
      const double from = found.imuTime(steps[end].t0), to = found.imuTime(steps[end].t1);
      if (!gyro.covers(from) || !gyro.covers(to)) continue;
      block.push_back({(gyro.at(to) - gyro.at(from)) / (to - from), found.R_imu_cam * steps[end].rate_C});
    }
    begin = std::max(end, begin + 1);
    if (block.size() < 4) continue;
    for (const Pair& pair : block) bias += pair.imu - pair.camera, count += 1;
    blocks.push_back(std::move(block));
  }
  if (count == 0) return;
  bias /= count;
  std::vector<Eigen::Vector2d> slow, fast;  // one a block: gyro squared, gyro times images
  for (const std::vector<Pair>& block : blocks) {
    Pair mean{-bias, Eigen::Vector3d::Zero()};
    for (const Pair& pair : block) mean.imu += pair.imu / block.size(), mean.camera += pair.camera / block.size();
    slow.emplace_back(mean.imu.squaredNorm(), mean.imu.dot(mean.camera));
    fast.emplace_back(0, 0);
    for (const Pair& pair : block) {
      const Eigen::Vector3d imu = pair.imu - bias - mean.imu;
      fast.back() += Eigen::Vector2d(imu.squaredNorm(), imu.dot(pair.camera - mean.camera));
    }
  }
  const auto gain = [](const std::vector<Eigen::Vector2d>& sums, double* value, double* sigma) {
    Eigen::Vector2d all = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& s : sums) all += s;
    if (all.y() <= 0) return;
    *value = all.x() / all.y();
    double scatter = 0;
    for (const Eigen::Vector2d& s : sums) scatter += std::pow(s.x() - *value * s.y(), 2);
    *sigma = std::sqrt(scatter) / all.y();
  };
  gain(slow, &out->gain_slow, &out->gain_slow_sigma);
  gain(fast, &out->gain_fast, &out->gain_fast_sigma);
}

}  // namespace

MotionEstimate estimateMotion(const Recording& r, const std::vector<RotationStep>& steps, double max_offset) {
  MotionEstimate out;
  if (steps.size() < 40 || r.gyro_samples.size() < 100) {
    out.why_not = "too few images with enough texture";
    return out;
  }
  const GyroIntegral gyro(r.gyro_samples);
  Search coarse;
  if (!search(steps, gyro, 0, max_offset, {0.1, 0.5}, &coarse)) {
    out.why_not = "images and gyroscope do not overlap in time";
    return out;
  }
  Search fine = coarse;
  if (!search(steps, gyro, coarse.offset, 0.02, {std::max(0.01, 3 * coarse.fit.median_error), 0.0}, &fine))
    fine = coarse;
  const Fit& fit = fine.fit;
  out.scale = fit.scale;
  out.correlation = fit.variance > 0 ? std::max(0.0, 1 - fit.residual / fit.variance) : 0;
  out.R_imu_cam = Eigen::Quaterniond(fit.R);
  constexpr double kTurns = 0.1;  // rad/s of the gyro, one sigma
  if (fit.camera_variances.sum() < 0.05 * 0.05) {
    out.why_not = "the sensor hardly rotates";
    out.contradicts = fit.variance > kTurns * kTurns;
    return out;
  }
  if (out.scale < 5 && out.correlation < 0.6) {
    out.why_not = formatted("image and gyro rotation do not agree (%.0f %% explained)", 100 * out.correlation);
    out.contradicts = fit.variance > kTurns * kTurns;
    return out;
  }
  if (fine.at_end || coarse.at_end) {
    out.why_not = formatted("no delay within %.0f ms fits images and gyroscope best", 1000 * max_offset);
    return out;
  }
  out.time_offset = fine.offset;
  out.time_sigma = fine.sigma;
  // The rotation is observable once there is motion about a second axis, 0.05 rad/s.
  out.rotation_known = fit.camera_variances(1) > 0.05 * 0.05;
  out.usable = true;
  const ReadoutEstimate start{fine.offset, 0.0, out.R_imu_cam};
  const auto rows = estimateReadout(steps, gyro, start);
  gainsOf(steps, gyro, rows.value_or(start), &out);
  if (rows && rows->readout_sigma < kUsefulReadout) {
    // With a rolling shutter the delay estimated without rows does not refer to a definite row.
    out.time_offset = rows->time_offset;
    out.time_sigma = rows->time_sigma;
    out.readout = rows->readout;
    out.readout_sigma = rows->readout_sigma;
  }
  // Without depth sideways motion passes for rotation, and with it for a delay.
  if (!rows) out.time_sigma = std::hypot(out.time_sigma, 0.01);
  if (rows) {
    out.time_drift = rows->time_drift;
    out.drift_sigma = rows->drift_sigma;
    std::vector<double> errors;
    for (const StepFit& fit : rows->fits) errors.push_back(fit.error);
    out.misfit = quantile(errors, 0.75);
    const Eigen::Vector3d arm = extrinsicsOfTf(r).value_or(r.sensor.T_imu_cam).t();
    out.inertial = fitInertialMotion(*rows, r.gyro_samples, r.accel_samples, arm);
  }
  return out;
}

}  // namespace vip_slam
