// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/io/pose_accuracy.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/statistics.h"
#include "vip_slam_sim/motion/spline_trajectory.h"

namespace vip_slam {
namespace {

double medianOf(std::vector<double> values) { return values.empty() ? 0 : upperMedian(std::move(values)); }

/// Root mean square over the three axes of each axis' robust sigma.
double robustSigma(const std::vector<Eigen::Vector3d>& values) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> magnitude;
    for (const Eigen::Vector3d& v : values) magnitude.push_back(std::abs(v[axis]));
    const double sigma = medianOf(std::move(magnitude)) / 0.6745;
    sum += sigma * sigma;
  }
  return std::sqrt(sum / 3);
}

PoseSigma residualOf(const SplineTrajectory& spline, const Trajectory& poses) {
  PoseSigma e;
  for (const StampedPose& p : poses) {
    const SE3 s = spline.at(p.t).T_W_I;
    e.position += (s.t() - p.T_W_B.t()).squaredNorm();
    e.rotation += logSO3(s.rotation().conjugate() * p.T_W_B.rotation()).squaredNorm();
  }
  const double n = 3.0 * static_cast<double>(poses.size());
  e.position = std::sqrt(e.position / n);
  e.rotation = std::sqrt(e.rotation / n);
  return e;
}

}  // namespace

double poseInterval(const Trajectory& poses) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < poses.size(); ++i) steps.push_back(poses[i].t - poses[i - 1].t);
  return medianOf(std::move(steps));
}

double imageInterval(const RgbdFolder& folder) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < folder.frames.size(); ++i) steps.push_back(folder.frames[i].t - folder.frames[i - 1].t);
  return medianOf(std::move(steps));
}

PoseSigma poseJitter(const Trajectory& poses) {
  PoseSigma out;
  if (poses.size() < 20) return out;
  const double step = poseInterval(poses);
  std::vector<Eigen::Vector3d> position, rotation;
  for (std::size_t i = 0; i + 4 < poses.size(); ++i) {
    const StampedPose* p = &poses[i];
    bool regular = true;
    for (int k = 0; k < 4; ++k) regular &= std::abs(p[k + 1].t - p[k].t - step) < 0.1 * step;
    if (!regular) continue;
    const auto turn = [&](int k) { return logSO3(p[k].T_W_B.rotation().conjugate() * p[k + 1].T_W_B.rotation()); };
    position.push_back(p[0].T_W_B.t() - 4 * p[1].T_W_B.t() + 6 * p[2].T_W_B.t() - 4 * p[3].T_W_B.t() + p[4].T_W_B.t());
    rotation.push_back(turn(3) - 3 * turn(2) + 3 * turn(1) - turn(0));
  }
  if (position.size() < 10) return out;
  const double gain = std::sqrt(70.0);  // noise gain of a fourth difference: 1 + 16 + 36 + 16 + 1
  out.position = robustSigma(position) / gain;
  out.rotation = robustSigma(rotation) / gain;
  return out;
}

double splineSpacing(const Trajectory& poses, const PoseSigma& jitter, int iterations) {
  const double step = poseInterval(poses);
  for (const double factor : {6.0, 4.0, 3.0, 2.0, 1.5}) {
    const PoseSigma e = residualOf(SplineTrajectory::fit(poses, factor * step, iterations), poses);
    // Residuals below 0.1 mm (and 0.1 mrad) are always acceptable, whatever the jitter.
    if (e.position < std::max(1.2 * jitter.position, 1e-4) && e.rotation < std::max(1.2 * jitter.rotation, 1e-4))
      return factor * step;
  }
  return step;
}

ImuNoise noiseOfImuFromPoses(const ImuNoise& sensor, const PoseSigma& jitter, double interval,
                             const std::vector<DepthDisagreement>& drift, double gravity) {
  // White noise of density N gives an angle error of N sqrt(t) after t, and a position error of N sqrt(t^3 / 3). The
  // relative error of two poses is sqrt(2) times their jitter; the noise has to cover that already over one image
  // interval, although jitter does not grow over longer ones.
  double gyro = 2 * jitter.rotation * jitter.rotation / interval;
  double accel = 6 * jitter.position * jitter.position / std::pow(interval, 3);
  // Only the error's growth with the lag is drift; the constant part is jitter, covered above, and registration noise.
  const DepthDisagreement* first = nullptr;
  double rate = 0, force = 0;
  for (const DepthDisagreement& d : drift) {
    if (d.pairs == 0) continue;
    if (!first) {
      first = &d;
      continue;
    }
    const auto growth = [](double now, double before) { return std::max(0.0, now * now - before * before); };
    const double time = d.lag - first->lag;
    const double angle = growth(d.error.rotation, first->error.rotation);
    rate = std::max(rate, angle / time);
    // A tilt error of the poses misdirects gravity, which acts as an acceleration error while the tilt lasts.
    force = std::max(force, 3 * growth(d.error.position, first->error.position) / std::pow(time, 3));
    force = std::max(force, gravity * gravity * angle * time);
  }
  ImuNoise out = sensor;
  out.gyro_noise_density = std::sqrt(sensor.gyro_noise_density * sensor.gyro_noise_density + gyro + rate);
  out.accel_noise_density = std::sqrt(sensor.accel_noise_density * sensor.accel_noise_density + accel + force);
  return out;
}

}  // namespace vip_slam
