#include "vip_slam_frontend/initialisation/moving_start.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>

#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

namespace {

// One sigma of a camera position from points with depth, m: covers wrong depth and drifting tracks.
constexpr double kPositionSigma = 0.006;
// Largest root-mean-square misfit, m and rad; beyond, the view moved or the poses are bad. Good starts, also with
// time-of-flight and structured-light cameras, have 1 to 5 mm and 0.4 to 1.5 mrad; a fast flight with an unknown
// rolling shutter of 20 ms passes in half of its attempts; with a person in front of the camera it is 7 to 100 mm and 4
// to 100 mrad.
constexpr double kWorstPosition = 0.008, kWorstRotation = 0.004;
constexpr std::size_t kFewestPoses = 5;
constexpr int kGravityRounds = 4;         // each turns gravity, of known length, in its tangent plane
constexpr double kLargestGyroBias = 0.5;  // rad/s; no gyro that works is further off

/// What camera and IMU say about the motion since the first image; all in the IMU frame of that image.
struct Motion {
  std::vector<SE3> T_0_k;           ///< IMU poses by the camera, the first included
  std::vector<Preintegration> pre;  ///< from the first image to each later one
  Eigen::Vector3d bias_gyro = Eigen::Vector3d::Zero();

  double intervals() const { return static_cast<double>(pre.size()); }
};

/// Preintegrates over all images with the gyro bias that makes its rotations agree with the camera's. False when the
/// IMU does not cover the images.
bool integrate(const std::vector<TimedCameraPose>& poses, const ImuBuffer& imu, const ImuNoise& noise,
               const Eigen::Matrix3d& gyro_correction, Motion* motion) {
  for (int round = 0; round < 2; ++round) {
    motion->pre.clear();
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (std::size_t k = 1; k < poses.size(); ++k) {
      const std::vector<ImuSample> samples =
          withGyroCorrection(imu.between(poses.front().t_imu, poses[k].t_imu), gyro_correction);
      if (samples.size() < 2) return false;
      motion->pre.emplace_back(samples, motion->bias_gyro, Eigen::Vector3d::Zero(), noise);
      const Preintegration& pre = motion->pre.back();
      const Eigen::Matrix3d& J = pre.J_theta_bg();
      A += J.transpose() * J;
      b += J.transpose() * logSO3(Eigen::Matrix3d(pre.deltaR().transpose() * motion->T_0_k[k].R()));
    }
    A.diagonal().array() += 1e-9;
    if (round == 0) motion->bias_gyro = A.ldlt().solve(b);
  }
  return true;
}

double rmsRotation(const Motion& motion) {
  double sum = 0;
  for (std::size_t k = 0; k < motion.pre.size(); ++k)
    sum += logSO3(Eigen::Matrix3d(motion.pre[k].deltaR().transpose() * motion.T_0_k[k + 1].R())).squaredNorm();
  return std::sqrt(sum / motion.intervals());
}

/// Velocity, gravity and accelerometer bias in the first IMU frame.
struct LinearStart {
  Eigen::Vector3d v_0, g, bias_accel;
  Eigen::MatrixXd covariance;  ///< of (v_0, g or its two turns, bias_accel)
};

/// Least squares over p_k = v_0 t - g t^2 / 2 + alpha + J b_a. With `g_fixed` only the direction of gravity is free,
/// about that one; the bias is held by its prior, which short motions cannot beat. Empty when the system is singular.
std::optional<LinearStart> solveLinear(const Motion& motion, double sigma_bias_accel, const Eigen::Vector3d* g_fixed) {
  const int n_g = g_fixed ? 2 : 3;
  const int n = 6 + n_g;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  Eigen::Matrix<double, 3, 2> basis;
  if (g_fixed) {
    const Eigen::Vector3d up = g_fixed->normalized();
    const Eigen::Vector3d helper = std::abs(up.x()) < 0.7 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    basis.col(0) = up.cross(helper).normalized();
    basis.col(1) = up.cross(basis.col(0));
  }
  for (std::size_t k = 0; k < motion.pre.size(); ++k) {
    const Preintegration& pre = motion.pre[k];
    const double t = pre.dt();
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, n);
    J.leftCols(3) = t * Eigen::Matrix3d::Identity();
    J.middleCols(3, n_g) = -0.5 * t * t * Eigen::MatrixXd::Identity(3, n_g);
    if (g_fixed) J.middleCols(3, 2) = -0.5 * t * t * basis;
    J.rightCols(3) = pre.J_alpha_ba();
    Eigen::Vector3d r = motion.T_0_k[k + 1].t() - pre.alpha();
    if (g_fixed) r += 0.5 * t * t * *g_fixed;
    A += J.transpose() * J / (kPositionSigma * kPositionSigma);
    b += J.transpose() * r / (kPositionSigma * kPositionSigma);
  }
  A.bottomRightCorner(3, 3).diagonal().array() += 1.0 / (sigma_bias_accel * sigma_bias_accel);
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(A);
  const Eigen::VectorXd x = ldlt.solve(b);
  if (!x.allFinite()) return std::nullopt;
  LinearStart start;
  start.v_0 = x.head<3>();
  start.g = g_fixed ? Eigen::Vector3d(*g_fixed + basis * x.segment<2>(3)) : Eigen::Vector3d(x.segment<3>(3));
  start.bias_accel = x.tail<3>();
  start.covariance = ldlt.solve(Eigen::MatrixXd::Identity(n, n));
  return start;
}

double rmsPosition(const Motion& motion, const LinearStart& start) {
  double sum = 0;
  for (std::size_t k = 0; k < motion.pre.size(); ++k) {
    const Preintegration& pre = motion.pre[k];
    const double t = pre.dt();
    sum += (start.v_0 * t - 0.5 * start.g * t * t + pre.alpha() + pre.J_alpha_ba() * start.bias_accel -
            motion.T_0_k[k + 1].t())
               .squaredNorm();
  }
  return std::sqrt(sum / motion.intervals());
}

/// The state at the last image, levelled by the gravity found, and how well it is known.
FilterPrior priorOf(const Motion& motion, const LinearStart& start, double t_imu, double rms_position,
                    const FilterOptions& options, double gravity) {
  const Preintegration& whole = motion.pre.back();
  const double t = whole.dt();
  const Eigen::Matrix3d R_0_k = motion.T_0_k.back().R();
  const Eigen::Vector3d v_k =
      start.v_0 - start.g * t + whole.beta() + whole.J_beta_ba() * start.bias_accel;  // first IMU frame
  const Eigen::Quaterniond q_W_k = gravityAlignedRotation(R_0_k.transpose() * start.g);
  FilterPrior prior;
  prior.state.t = t_imu;
  prior.state.T_W_I = SE3(q_W_k, Eigen::Vector3d::Zero());
  prior.state.v_W = q_W_k * (R_0_k.transpose() * v_k);
  prior.state.bias_gyro = motion.bias_gyro;
  prior.state.bias_accel = start.bias_accel;
  // When the misfit is larger than expected, the sigmas of the estimates grow in proportion.
  const double worse = std::max(1.0, rms_position / kPositionSigma);
  const double sigma_gravity = worse * std::sqrt(start.covariance.block(3, 3, 2, 2).diagonal().maxCoeff());
  const double sigma_v0 = worse * std::sqrt(start.covariance.topLeftCorner(3, 3).diagonal().maxCoeff());
  prior.sigma_tilt = 0.01 + sigma_gravity / gravity;
  prior.sigma_velocity = 0.02 + sigma_v0 + t * sigma_gravity;
  prior.sigma_bias_gyro = std::min(options.sigma_bias_gyro, 0.002 + 0.004 / t);
  prior.sigma_bias_accel = options.sigma_bias_accel;
  return prior;
}

MovingStart failure(const std::string& reason) {
  MovingStart result;
  result.reason = reason;
  return result;
}

}  // namespace

MovingStart solveMovingStart(const std::vector<TimedCameraPose>& poses, const ImuBuffer& imu, const SE3& T_I_C,
                             const ImuNoise& noise, const FilterOptions& options, double gravity,
                             const Eigen::Matrix3d& gyro_correction) {
  if (poses.size() < kFewestPoses) return failure(formatted("%zu camera poses, needs %zu", poses.size(), kFewestPoses));
  Motion motion;
  const SE3 T_C_I = T_I_C.inverse();
  for (const TimedCameraPose& pose : poses) motion.T_0_k.push_back(T_I_C * pose.T_first_C * T_C_I);
  if (!integrate(poses, imu, noise, gyro_correction, &motion)) return failure("the IMU does not cover the images");
  const double bias = motion.bias_gyro.norm(), rms_rotation = rmsRotation(motion);
  if (bias > kLargestGyroBias || rms_rotation > kWorstRotation)
    return failure(
        formatted("gyro and camera rotations disagree by %.1f mrad after a gyro bias of %.2f rad/s, at most "
                  "%g and %g; does something move before the camera?",
                  1e3 * rms_rotation, bias, 1e3 * kWorstRotation, kLargestGyroBias));

  // First with gravity free, then with its length known.
  std::optional<LinearStart> start = solveLinear(motion, options.sigma_bias_accel, nullptr);
  MovingStart result;
  if (start) result.gravity_error = std::abs(start->g.norm() - gravity);
  for (int round = 0; round < kGravityRounds && start; ++round) {
    const Eigen::Vector3d g = gravity * start->g.normalized();
    start = solveLinear(motion, options.sigma_bias_accel, &g);
  }
  if (!start) return failure("velocity and gravity could not be solved");
  start->g *= gravity / start->g.norm();
  result.rms_position = rmsPosition(motion, *start);
  if (result.rms_position > kWorstPosition) {
    result.reason = formatted(
        "camera and IMU motions disagree by %.1f mm, at most %g; does something move before the "
        "camera?",
        1e3 * result.rms_position, 1e3 * kWorstPosition);
    return result;
  }
  result.prior = priorOf(motion, *start, poses.back().t_imu, result.rms_position, options, gravity);
  result.ok = true;
  return result;
}

}  // namespace vip_slam
