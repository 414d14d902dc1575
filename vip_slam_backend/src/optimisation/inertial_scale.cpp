// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/optimisation/inertial_scale.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

// Shorter intervals are joined, since in them the poses' noise is not small against the displacement by acceleration.
constexpr double kMinInterval = 0.5, kLongestInterval = 3.0;  // s
constexpr double kMinTime = 10.0;                             // s, total of all intervals
constexpr double kMinPoseSigma = 1e-5, kMaxPoseSigma = 0.01;  // of a keyframe relative to its neighbour, m
constexpr int kPoseSigmaSteps = 8;
constexpr double kTiltSigma = 0.01;      // prior of the map's tilt against gravity, rad
constexpr double kGravitySigma = 0.002;  // relative, variation over the earth
constexpr double kBiasSigma = 0.5;       // prior at the beginning of each chain, m/s^2
// With a larger sigma of the scale the motion is not informative enough: it is reported as unknown.
constexpr double kLargestSigma = 0.01;
constexpr double kSure = 5.0;
// Beyond this share the estimate is linearised too far away to be entered anywhere.
constexpr double kLargeDifference = 0.05;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Increments of position and velocity over several keyframe intervals, in the body's frame at the first.
struct Increments {
  double dt = 0;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d alpha = Eigen::Vector3d::Zero(), beta = Eigen::Vector3d::Zero();      ///< at bias zero
  Eigen::Matrix3d J_alpha = Eigen::Matrix3d::Zero(), J_beta = Eigen::Matrix3d::Zero();  ///< by the accelerometer bias
  Matrix6 covariance = Matrix6::Zero();

  void append(const Preintegration& next) {
    const double t = next.dt();
    const Eigen::Vector3d& bias = next.biasAccel();
    const Eigen::Vector3d alpha_next = next.alpha() - next.J_alpha_ba() * bias;
    const Eigen::Vector3d beta_next = next.beta() - next.J_beta_ba() * bias;
    alpha += beta * t + R * alpha_next;
    J_alpha += J_beta * t + R * next.J_alpha_ba();
    beta += R * beta_next;
    J_beta += R * next.J_beta_ba();
    Matrix6 A = Matrix6::Identity(), turn = Matrix6::Zero();
    A.topRightCorner<3, 3>() = t * Eigen::Matrix3d::Identity();
    turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = R;
    covariance = A * covariance * A.transpose() + turn * next.covariance().block<6, 6>(3, 3) * turn.transpose();
    R *= next.deltaR();
    dt += t;
  }
};

/// Least squares over corrections of [states shared by all intervals | velocity, bias of one keyframe], keyframe by
/// keyframe: x^T A x - 2 b^T x + c.
class ScaleFit {
 public:
  static constexpr int kShared = 4;  ///< scale, tilt about the world's x and y, gravity
  ScaleFit(double gravity, double pose_sigma) : gravity_(gravity), pose_variance_(2 * pose_sigma * pose_sigma) {
    A_(1, 1) = A_(2, 2) = 1.0 / (kTiltSigma * kTiltSigma);
    A_(3, 3) = 1.0 / (kGravitySigma * kGravitySigma * gravity * gravity);
  }

  /// Begins a chain: a keyframe without IMU from the one before.
  void begin() {
    forgetFirst();
    A_.diagonal().segment<3>(kShared).setConstant(1e-6);
    A_.diagonal().segment<3>(kShared + 3).setConstant(1.0 / (kBiasSigma * kBiasSigma));
  }

  void add(const NavState& from, const NavState& to, const Increments& imu, double random_walk) {
    const Eigen::Vector3d G = gravityVector(gravity_), dp = to.T_W_I.t() - from.T_W_I.t();
    const Eigen::Matrix3d R = from.T_W_I.R();
    const double dt = imu.dt;
    // s dp - v dt + G dt^2 / 2 - R (alpha + J b), v' - v + G dt - R (beta + J b), b' - b
    Eigen::Matrix<double, 9, kColumns> J = Eigen::Matrix<double, 9, kColumns>::Zero();
    Eigen::Matrix<double, 9, 1> r = Eigen::Matrix<double, 9, 1>::Zero();
    const Eigen::Vector3d p = R * (imu.alpha + imu.J_alpha * from.bias_accel);
    const Eigen::Vector3d v = R * (imu.beta + imu.J_beta * from.bias_accel);
    J.block<3, 1>(0, 0) = dp;
    J.block<3, 2>(0, 1) = hat(p).leftCols<2>();
    J.block<3, 2>(3, 1) = hat(v).leftCols<2>();
    J(2, 3) = 0.5 * dt * dt;
    J(5, 3) = dt;
    J.block<3, 3>(0, kFirst) = -dt * Eigen::Matrix3d::Identity();
    J.block<3, 3>(3, kFirst) = -Eigen::Matrix3d::Identity();
    J.block<3, 3>(3, kSecond) = Eigen::Matrix3d::Identity();
    J.block<3, 3>(0, kFirst + 3) = -R * imu.J_alpha;
    J.block<3, 3>(3, kFirst + 3) = -R * imu.J_beta;
    J.block<3, 3>(6, kFirst + 3) = -Eigen::Matrix3d::Identity();
    J.block<3, 3>(6, kSecond + 3) = Eigen::Matrix3d::Identity();
    r.head<3>() = p - 0.5 * G * dt * dt + from.v_W * dt - dp;
    r.segment<3>(3) = v - G * dt + from.v_W - to.v_W;
    r.tail<3>() = from.bias_accel - to.bias_accel;
    Matrix6 turn = Matrix6::Zero();
    turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = R;
    Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
    covariance.topLeftCorner<6, 6>() = turn * imu.covariance * turn.transpose();
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
    time_ += dt;
    rows_ += 3;  // of six rows, three determine the new velocity
    forgetFirst();
  }

  /// Ends the last chain and solves. False with too little data.
  bool solve() {
    forgetFirst();
    if (time_ < kMinTime || rows_ <= kShared) return false;
    const Eigen::LDLT<Eigen::Matrix4d> ldlt(A_.topLeftCorner<kShared, kShared>());
    const Eigen::Vector4d x = ldlt.solve(b_.head<kShared>());
    misfit_ = (c_ - b_.head<kShared>().dot(x)) / (rows_ - kShared);
    const double variance = ldlt.solve(Eigen::Vector4d::Unit(0))(0) * std::max(1.0, misfit_);
    // A scale that is wrong by much makes a large misfit of its own: then its sigma may be larger too.
    const double largest = std::max(kLargestSigma, std::abs(x(0)) / kSure);
    if (!std::isfinite(x(0)) || !(variance > 0) || variance > largest * largest) return false;
    scale_.factor = 1 + x(0);
    scale_.sigma = std::sqrt(variance);
    return true;
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
  double c_ = 0, time_ = 0;
  int rows_ = 0;
};

/// IMU from one keyframe to another; without `from` a chain begins at `to`.
struct Interval {
  const MapKeyframe *from, *to;
  Increments imu;
};

std::vector<Interval> intervalsOf(const Map& map) {
  std::vector<Interval> intervals;
  const MapKeyframe* from = nullptr;  // where the present interval began
  KeyframeId newest = 0;
  Increments imu;
  for (const auto& [id, kf] : map.keyframes()) {
    if (kf.stored) continue;
    const bool linked = from && kf.previous == newest && kf.preintegration;
    newest = id;
    if (linked) {
      imu.append(*kf.preintegration);
      if (imu.dt < kMinInterval) continue;
    }
    intervals.push_back({linked && imu.dt < kLongestInterval ? from : nullptr, &kf, imu});
    from = &kf;
    imu = Increments();
  }
  return intervals;
}

}  // namespace

InertialScale inertialScale(const Map& map, double gravity, const ImuNoise& noise) {
  const std::vector<Interval> intervals = intervalsOf(map);
  const auto fitWith = [&](double pose_sigma) {
    ScaleFit fit(gravity, pose_sigma);
    for (const Interval& i : intervals) {
      i.from ? fit.add(i.from->state, i.to->state, i.imu, noise.accel_random_walk) : fit.begin();
    }
    fit.solve();
    return fit;
  };
  // The poses' sigma is the one for which the residuals are consistent, found by bisection.
  double low = kMinPoseSigma, high = kMaxPoseSigma;
  for (int step = 0; step < kPoseSigmaSteps; ++step) {
    const double middle = std::sqrt(low * high);
    (fitWith(middle).misfit() < 1 ? low : high) = middle;
  }
  return fitWith(low).scale();
}

bool isLarge(const InertialScale& scale) {
  const double difference = std::abs(scale.factor - 1);
  return scale.sigma > 0 && difference > kLargeDifference && difference > kSure * scale.sigma;
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
