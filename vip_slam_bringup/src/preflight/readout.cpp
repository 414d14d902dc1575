// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/preflight/readout.h"

#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr std::size_t kMinTracks = 12;
constexpr int kRounds = 12, kUnknowns = 9, kDrift = 8;  // td, r, rotation (3), bias (3), drift of td
constexpr double kUsualDrift = 1e-3;                    // one sigma: no quartz is off by more
constexpr double kTogether = 0.5;                       // s in which errors are taken for common ...
constexpr int kBlocks = 40;                             // ... as far as so many such blocks are left
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

struct State {
  double middle, time_offset, readout;
  Eigen::Matrix3d R_imu_cam;
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  // rad/s
  double drift = 0;

  double imuTime(double t) const { return t + time_offset + drift * (t - middle); }
  State plus(const Unknowns& d) const {
    return {middle,
            time_offset + d(0),
            readout + d(1),
            R_imu_cam * expSO3(Eigen::Vector3d(d.segment<3>(2))),
            bias + d.segment<3>(5),
            drift + d(kDrift)};
  }
};

/// Residuals of a step's corners in its second image, predicted about a given motion, and their Jacobian by the
/// velocity (two rows per corner).
struct Prediction {
  Eigen::VectorXd residual;
  Eigen::MatrixX3d by_speed;
};

bool covered(const RotationStep& step, const GyroIntegral& gyro, double margin) {
  return gyro.covers(step.t0 - margin) && gyro.covers(step.t1 + margin);
}

/// Translation of the camera between two images, in the first camera: m/s at the middle between them, m/s^2.
struct Course {
  Eigen::Vector3d speed = Eigen::Vector3d::Zero(), acceleration = Eigen::Vector3d::Zero();
};

/// `course`: linearisation point of the projection.
Prediction predict(const RotationStep& step, const GyroIntegral& gyro, const State& x, const Course& course) {
  const int n = static_cast<int>(step.tracks.size());
  Prediction p{Eigen::VectorXd(2 * n), Eigen::MatrixX3d(2 * n, 3)};
  for (int i = 0; i < n; ++i) {
    const CornerTrack& track = step.tracks[i];
    const double from = x.imuTime(step.t0) + x.readout * track.row_from;
    const double to = x.imuTime(step.t1) + x.readout * track.row_to;
    const Eigen::Vector3d turn = x.R_imu_cam.transpose() * (gyro.at(to) - gyro.at(from) - (to - from) * x.bias);
    const Eigen::Matrix3d R_to_from = expSO3(Eigen::Vector3d(-turn));
    const double late = 0.5 * x.readout * (track.row_from + track.row_to);  // after the middle between the images
    const Eigen::Vector3d speed = course.speed + late * course.acceleration;
    const Eigen::Vector3d q = R_to_from * (track.point.cast<double>() - (to - from) * speed);
    Eigen::Matrix<double, 2, 3> projection;
    projection << 1 / q.z(), 0, -q.x() / (q.z() * q.z()), 0, 1 / q.z(), -q.y() / (q.z() * q.z());
    p.residual.segment<2>(2 * i) = q.hnormalized() - track.image.cast<double>();
    p.by_speed.middleRows<2>(2 * i) = -(to - from) * projection * R_to_from;
  }
  return p;
}

std::vector<double> errorsOf(const Eigen::VectorXd& residual) {
  std::vector<double> errors;
  for (int i = 0; i < residual.size() / 2; ++i) errors.push_back(residual.segment<2>(2 * i).norm());
  return errors;
}

/// Weights of the corners' rows: inverse of the step's typical error, with Huber weights at twice the median, so that a
/// blurred pair of images has little weight.
Eigen::VectorXd weightsOf(const Eigen::VectorXd& residual) {
  constexpr double kMinError = 1e-4;  // a twentieth of a pixel
  const std::vector<double> errors = errorsOf(residual);
  const double typical = upperMedian(errors) + kMinError;
  Eigen::VectorXd weights(residual.size());
  for (std::size_t i = 0; i < errors.size(); ++i)
    weights.segment<2>(2 * static_cast<int>(i))
        .setConstant(std::min(1.0, 2 * typical / errors[i]) / (typical * typical));
  return weights;
}

/// One step's contribution to the normal equations, its velocity eliminated.
struct Share {
  Eigen::Matrix<double, kUnknowns, kUnknowns> H;
  Unknowns g;
};

/// Also sets the velocity of `course` to the best fit.
Share shareOf(const RotationStep& step, const GyroIntegral& gyro, const State& x, Course* course) {
  Prediction p = predict(step, gyro, x, *course);
  Eigen::VectorXd w;
  for (int round = 0; round < 3; ++round) {
    w = weightsOf(p.residual);
    const Eigen::Matrix3d A = p.by_speed.transpose() * w.asDiagonal() * p.by_speed + 1e-9 * Eigen::Matrix3d::Identity();
    course->speed -= A.ldlt().solve(p.by_speed.transpose() * (w.asDiagonal() * p.residual));
    p = predict(step, gyro, x, *course);
  }
  w = weightsOf(p.residual);
  constexpr double kDelta[kDrift] = {1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3};
  Eigen::MatrixXd J(p.residual.size(), kUnknowns);
  for (int c = 0; c < kDrift; ++c) {
    const Unknowns d = Unknowns::Unit(c) * kDelta[c];
    J.col(c) = (predict(step, gyro, x.plus(d), *course).residual - predict(step, gyro, x.plus(-d), *course).residual) /
               (2 * kDelta[c]);
  }
  J.col(kDrift) = (0.5 * (step.t0 + step.t1) - x.middle) * J.col(0);
  const Eigen::Matrix3d A = p.by_speed.transpose() * w.asDiagonal() * p.by_speed + 1e-9 * Eigen::Matrix3d::Identity();
  const Eigen::MatrixXd by_speed_w = p.by_speed.transpose() * w.asDiagonal();
  const Eigen::MatrixXd projected = J - p.by_speed * A.ldlt().solve(by_speed_w * J);
  return {projected.transpose() * w.asDiagonal() * projected, projected.transpose() * (w.asDiagonal() * p.residual)};
}

/// Accelerations from the velocities before and after, where images follow each other: a drone accelerates as it tilts,
/// which would otherwise bias the readout.
void accelerate(const std::vector<const RotationStep*>& steps, const GyroIntegral& gyro, const State& x,
                std::vector<Course>* courses) {
  const auto turned = [&](double from, double to) {  // R_from_to of the camera
    return expSO3(Eigen::Vector3d(x.R_imu_cam.transpose() *
                                  (gyro.at(x.imuTime(to)) - gyro.at(x.imuTime(from)) - (to - from) * x.bias)));
  };
  for (std::size_t k = 1; k + 1 < steps.size(); ++k) {
    const RotationStep &before = *steps[k - 1], &now = *steps[k], &after = *steps[k + 1];
    if (before.t1 != now.t0 || now.t1 != after.t0) continue;
    const Eigen::Vector3d earlier = turned(before.t0, now.t0).transpose() * (*courses)[k - 1].speed;
    const Eigen::Vector3d later = turned(now.t0, after.t0) * (*courses)[k + 1].speed;
    (*courses)[k].acceleration = (later - earlier) * 2 / (after.t0 + after.t1 - before.t0 - before.t1);
  }
}

}  // namespace

std::optional<ReadoutEstimate> estimateReadout(const std::vector<RotationStep>& steps, const GyroIntegral& gyro,
                                               const ReadoutEstimate& start) {
  constexpr double kMargin = 0.1;  // seconds of gyro around the images
  std::vector<const RotationStep*> used;
  for (const RotationStep& s : steps)
    if (s.tracks.size() >= kMinTracks && covered(s, gyro, kMargin + std::abs(start.time_offset))) used.push_back(&s);
  if (used.size() < 40) return std::nullopt;

  const double middle = 0.5 * (used.front()->t0 + used.back()->t1);
  const double together_for = std::min(kTogether, 2 * (middle - used.front()->t0) / kBlocks);
  State x{middle, start.time_offset, start.readout, start.R_imu_cam.toRotationMatrix()};
  Eigen::Matrix<double, kUnknowns, kUnknowns> covariance;
  std::vector<Course> courses(used.size());
  bool settled = false;
  for (int round = 0; round < kRounds && !settled; ++round) {
    Eigen::Matrix<double, kUnknowns, kUnknowns> H = 1e-12 * Eigen::Matrix<double, kUnknowns, kUnknowns>::Identity();
    Eigen::Matrix<double, kUnknowns, kUnknowns> scatter = 0 * H;
    Unknowns g = Unknowns::Zero();
    Unknowns together = Unknowns::Zero();
    double block = used.front()->t0;
    int blocks = 0;
    H(kDrift, kDrift) = scatter(kDrift, kDrift) = 1 / (kUsualDrift * kUsualDrift);
    g(kDrift) = x.drift / (kUsualDrift * kUsualDrift);
    for (std::size_t k = 0; k < used.size(); ++k) {
      const Share share = shareOf(*used[k], gyro, x, &courses[k]);
      H += share.H;
      g += share.g;
      together += share.g;
      if (k + 1 < used.size() && used[k + 1]->t0 < block + together_for) continue;
      scatter += together * together.transpose();
      together.setZero();
      ++blocks;
      if (k + 1 < used.size()) block = used[k + 1]->t0;
    }
    const Unknowns d = -H.ldlt().solve(g);
    x = x.plus(d);
    if (!d.allFinite() || std::abs(x.time_offset - start.time_offset) > kMargin / 2 || std::abs(x.readout) > kMargin)
      return std::nullopt;
    accelerate(used, gyro, x, &courses);
    // Errors common to a pair of images (blur, gyro noise) are in all their corners, and those of a view last while it
    // is seen: take the covariance by blocks.
    const Eigen::Matrix<double, kUnknowns, kUnknowns> inverse =
        H.ldlt().solve(Eigen::Matrix<double, kUnknowns, kUnknowns>::Identity());
    covariance = inverse * scatter * inverse * (double(blocks) / std::max(1, blocks - kUnknowns));
    const auto below = [&](double seconds, double drift, double sigmas) {
      const auto is = [&](int i, double least) {
        return std::abs(d(i)) < std::max(least, sigmas * std::sqrt(covariance(i, i)));
      };
      return is(0, seconds) && is(1, seconds) && is(kDrift, drift);
    };
    // What still creeps after all rounds by far less than it is known by has settled as well.
    settled = below(1e-5, 1e-6, round + 1 < kRounds ? 0 : 0.1);
  }
  if (!settled) return std::nullopt;
  ReadoutEstimate out{x.time_offset, x.readout, Eigen::Quaterniond(x.R_imu_cam)};
  out.time_sigma = std::sqrt(covariance(0, 0));
  out.readout_sigma = std::sqrt(covariance(1, 1));
  out.gyro_bias = x.bias;
  out.middle = middle;
  out.time_drift = x.drift;
  out.drift_sigma = std::sqrt(covariance(kDrift, kDrift));
  for (std::size_t k = 0; k < used.size(); ++k)
    out.fits.push_back({x.imuTime(used[k]->t0), x.imuTime(used[k]->t1), courses[k].speed,
                        upperMedian(errorsOf(predict(*used[k], gyro, x, courses[k]).residual))});
  return out;
}

}  // namespace vip_slam
