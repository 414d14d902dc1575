// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/optimisation/inertial_scale.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "jackknife.h"
#include "odometry_factors.h"
#include "vip_slam_backend/factors/motion_prior.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/significance.h"

namespace vip_slam {
namespace {

constexpr double kGravitySigma = 0.002;  // relative, variation over the earth
// Beyond this share the estimate is linearised too far away to be entered anywhere.
constexpr double kLargeDifference = 0.05;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Least squares over corrections of [states shared by all intervals | velocity, bias of one keyframe], keyframe by
/// keyframe: x^T A x - 2 b^T x + c.
class ScaleFit {
 public:
  static constexpr int kShared = 4;  ///< scale, tilt about the world's x and y, gravity
  /// `pose_variance`: of a keyframe's place relative to its neighbour, m^2, per axis.
  ScaleFit(double gravity, double pose_variance) : gravity_(gravity), pose_variance_(pose_variance) {
    A_(3, 3) = 1.0 / (kGravitySigma * kGravitySigma * gravity * gravity);
  }

  /// Begins a chain: a keyframe without IMU from the one before.
  void begin() {
    forgetFirst();
    A_.diagonal().segment<3>(kShared).setConstant(1e-6);
    const double bias_sigma = MotionPrior().sigma_ba;
    A_.diagonal().segment<3>(kShared + 3).setConstant(1.0 / (bias_sigma * bias_sigma));
  }

  void add(const NavState& from, const NavState& to, const Preintegration& imu, double random_walk) {
    const Eigen::Vector3d G = gravityVector(gravity_), dp = to.T_W_I.t() - from.T_W_I.t();
    const Eigen::Matrix3d R = from.T_W_I.R();
    const double dt = imu.dt();
    const Eigen::Vector3d dba = from.bias_accel - imu.biasAccel();
    // s dp - v dt + G dt^2 / 2 - R (alpha + J b), v' - v + G dt - R (beta + J b), b' - b
    Eigen::Matrix<double, 9, kColumns> J = Eigen::Matrix<double, 9, kColumns>::Zero();
    Eigen::Matrix<double, 9, 1> r = Eigen::Matrix<double, 9, 1>::Zero();
    const Eigen::Vector3d p = R * (imu.alpha() + imu.J_alpha_ba() * dba);
    const Eigen::Vector3d v = R * (imu.beta() + imu.J_beta_ba() * dba);
    J.block<3, 1>(0, 0) = dp;
    J.block<3, 2>(0, 1) = hat(p).leftCols<2>();
    J.block<3, 2>(3, 1) = hat(v).leftCols<2>();
    J(2, 3) = 0.5 * dt * dt;
    J(5, 3) = dt;
    J.block<3, 3>(0, kFirst) = -dt * Eigen::Matrix3d::Identity();
    J.block<3, 3>(3, kFirst) = -Eigen::Matrix3d::Identity();
    J.block<3, 3>(3, kSecond) = Eigen::Matrix3d::Identity();
    J.block<3, 3>(0, kFirst + 3) = -R * imu.J_alpha_ba();
    J.block<3, 3>(3, kFirst + 3) = -R * imu.J_beta_ba();
    J.block<3, 3>(6, kFirst + 3) = -Eigen::Matrix3d::Identity();
    J.block<3, 3>(6, kSecond + 3) = Eigen::Matrix3d::Identity();
    r.head<3>() = p - 0.5 * G * dt * dt + from.v_W * dt - dp;
    r.segment<3>(3) = v - G * dt + from.v_W - to.v_W;
    r.tail<3>() = from.bias_accel - to.bias_accel;
    Matrix6 turn = Matrix6::Zero();
    turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = R;
    Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
    covariance.topLeftCorner<6, 6>() = turn * imu.covariance().block<6, 6>(3, 3) * turn.transpose();
    covariance.diagonal().tail<3>().setConstant(random_walk * random_walk * dt);
    // The bundle adjustment has already moved the poses towards the IMU, so a residual is only the IMU's share of it:
    // scale it up to the sum of both noises.
    const Eigen::Matrix<double, 9, 1> share = covariance.llt().solve(r);
    covariance.diagonal().head<3>().array() += pose_variance_;
    r = covariance * share;
    const Eigen::LLT<Eigen::Matrix<double, 9, 9>> llt(covariance);
    llt.matrixL().solveInPlace(J);
    llt.matrixL().solveInPlace(r);

    A_ += J.transpose() * J;
    b_ += J.transpose() * r;
    c_ += r.squaredNorm();
    rows_ += 3;  // of six rows, three determine the new velocity
    forgetFirst();
  }

  /// Ends the last chain and solves. The scale stays unknown where it is not even known that there are distances.
  void solve() {
    forgetFirst();
    if (rows_ <= kShared) return;
    const Eigen::LDLT<Eigen::Matrix4d> ldlt(A_.topLeftCorner<kShared, kShared>());
    const Eigen::Vector4d x = ldlt.solve(b_.head<kShared>());
    misfit_ = (c_ - b_.head<kShared>().dot(x)) / (rows_ - kShared);
    const double sigma = std::sqrt(ldlt.solve(Eigen::Vector4d::Unit(0))(0) * std::max(1.0, misfit_));
    if (std::isfinite(x(0)) && sigma > 0 && 1 + x(0) > kNoiseSigmas * sigma) scale_ = {1 + x(0), sigma};
  }
  const InertialScale& scale() const { return scale_; }
  double misfit() const { return misfit_; }  ///< squared residual per degree of freedom; 1 when the noise is right

 private:
  static constexpr int kFirst = kShared, kSecond = kShared + 6, kColumns = kShared + 12;

  /// Eliminates the first keyframe's velocity and bias; the second's take their place.
  void forgetFirst() {
    const Matrix6 first = A_.block<6, 6>(kFirst, kFirst);
    Eigen::Matrix<double, kColumns, kColumns> A = A_;
    Eigen::Matrix<double, kColumns, 1> b = b_;
    if (first.diagonal().maxCoeff() > 0) {
      const Eigen::LDLT<Matrix6> ldlt(first);
      const Eigen::Matrix<double, 6, kColumns> X = ldlt.solve(A_.middleRows<6>(kFirst));
      const Vector6 y = ldlt.solve(b_.segment<6>(kFirst));
      A -= A_.middleCols<6>(kFirst) * X;
      b -= A_.middleCols<6>(kFirst) * y;
      c_ -= b_.segment<6>(kFirst).dot(y);
    }
    A_.setZero();
    b_.setZero();
    A_.topLeftCorner<kShared, kShared>() = A.topLeftCorner<kShared, kShared>();
    A_.block<kShared, 6>(0, kFirst) = A.block<kShared, 6>(0, kSecond);
    A_.block<6, kShared>(kFirst, 0) = A.block<6, kShared>(kSecond, 0);
    A_.block<6, 6>(kFirst, kFirst) = A.block<6, 6>(kSecond, kSecond);
    b_.head<kShared>() = b.head<kShared>();
    b_.segment<6>(kFirst) = b.segment<6>(kSecond);
  }

  double gravity_, pose_variance_;
  InertialScale scale_;
  double misfit_ = 0;
  Eigen::Matrix<double, kColumns, kColumns> A_ = Eigen::Matrix<double, kColumns, kColumns>::Zero();
  Eigen::Matrix<double, kColumns, 1> b_ = Eigen::Matrix<double, kColumns, 1>::Zero();
  double c_ = 0;
  int rows_ = 0;
};

/// A keyframe of this session with the one before it, where an IMU factor joins the two.
struct Interval {
  const MapKeyframe *before, *keyframe;
};

std::vector<Interval> intervalsOf(const Map& map) {
  std::vector<Interval> intervals;
  const MapKeyframe* before = nullptr;
  for (const auto& [id, kf] : map.keyframes()) {
    if (kf.stored) continue;
    if (before && kf.previous == before->id() && kf.preintegration) intervals.push_back({before, &kf});
    before = &kf;
  }
  return intervals;
}

ScaleFit fitScale(const std::vector<Interval>& intervals, double gravity, double random_walk, double pose_variance) {
  ScaleFit fit(gravity, pose_variance);
  const MapKeyframe* last = nullptr;
  for (const Interval& i : intervals) {
    if (i.before != last) fit.begin();
    fit.add(i.before->state, i.keyframe->state, *i.keyframe->preintegration, random_walk);
    last = i.keyframe;
  }
  fit.solve();
  return fit;
}

}  // namespace

InertialScale inertialScale(const Map& map, double gravity, const ImuNoise& noise) {
  const std::vector<Interval> intervals = intervalsOf(map);
  const auto fitWith = [&](double variance) { return fitScale(intervals, gravity, noise.accel_random_walk, variance); };
  // The poses' variance is the one for which the residuals are consistent. The misfit is about linear in it.
  double low = 0, high = leastCovariance(Matrix6::Zero())(5, 5);
  double below = fitWith(low).misfit(), above = fitWith(high).misfit();
  while (above < 1 && above > below) {
    low = std::exchange(high, 2 * high);
    below = std::exchange(above, fitWith(high).misfit());
  }
  const double share = below < 1 && above > below ? std::min(1.0, (1 - below) / (above - below)) : 0.0;
  const double variance = low + share * (high - low);
  InertialScale scale = fitWith(variance).scale();
  if (scale.sigma == 0) return scale;
  // The normal equations' sigma knows nothing of a single interval that is wrong, as one whose poses are off.
  const auto factor = [&](const std::vector<Interval>& others) -> std::optional<double> {
    const InertialScale found = fitScale(others, gravity, noise.accel_random_walk, variance).scale();
    return found.sigma > 0 ? std::make_optional(found.factor) : std::nullopt;
  };
  const std::optional<double> varies = jackknifeSigma(intervals, factor);
  if (!varies) return {};
  scale.sigma = std::max(scale.sigma, *varies);
  return scale;
}

bool isLarge(const InertialScale& scale) {
  const double difference = std::abs(scale.factor - 1);
  return scale.sigma > 0 && difference > kLargeDifference && difference > kNoiseSigmas * scale.sigma;
}

std::string scaleDifference(const InertialScale& scale, const SensorConfig& sensor) {
  if (!isLarge(scale)) return "";
  const double difference = scale.factor - 1;
  return formatted(
      "distances are %s than the accelerometer says, by some %.0f %%: is the unit of depth (depth/scale: %.6g) right, "
      "and the accelerometer's, is the IMU smoothed (check_bag tells)? what else was learnt of the calibration is not "
      "to be trusted",
      difference < 0 ? "longer" : "shorter", 100 * std::abs(difference), sensor.depth_scale);
}

}  // namespace vip_slam
