#include "vip_slam_frontend/initialisation/moving_start.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/imu/preintegration.h"

namespace vip_slam {

namespace {

// Errors of a camera pose from depth: what a wrong depth or a creeping track shifts it by.
constexpr double kPositionSigma = 0.006;
// Beyond these root mean squares something else moved, or the poses are worth nothing. Sound starts, with time of
// flight and structured light as well, have 1 to 5 mm and 0.4 to 1.5 mrad; a fast flight with an unknown rolling
// shutter of 20 ms stays below in half of its tries; with a walker before the camera it is 7 to 100 mm and 4 to 100
// mrad.
constexpr double kWorstPosition = 0.008, kWorstRotation = 0.004;

}  // namespace

MovingStart solveMovingStart(const std::vector<TimedCameraPose>& poses, const ImuBuffer& imu, const SE3& T_I_C,
                             const ImuNoise& noise, const FilterOptions& options, double gravity,
                             const Eigen::Matrix3d& gyro_correction) {
  MovingStart result;
  if (poses.size() < 5) {
    result.reason = "fewer than five camera poses";
    return result;
  }
  const double t0 = poses.front().t_imu;
  const SE3 T_C_I = T_I_C.inverse();
  std::vector<SE3> T_0_k;  // IMU poses in the first IMU frame
  for (const TimedCameraPose& pose : poses) T_0_k.push_back(T_I_C * pose.T_first_C * T_C_I);

  Eigen::Vector3d bias_gyro = Eigen::Vector3d::Zero();
  std::vector<Preintegration> pre;
  for (int round = 0; round < 2; ++round) {
    pre.clear();
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (std::size_t k = 1; k < poses.size(); ++k) {
      const std::vector<ImuSample> samples = withGyroCorrection(imu.between(t0, poses[k].t_imu), gyro_correction);
      if (samples.size() < 2) {
        result.reason = "the IMU does not cover the images";
        return result;
      }
      pre.emplace_back(samples, bias_gyro, Eigen::Vector3d::Zero(), noise);
      const Eigen::Matrix3d& J = pre.back().J_theta_bg();
      A += J.transpose() * J;
      b += J.transpose() * logSO3(Eigen::Matrix3d(pre.back().deltaR().transpose() * T_0_k[k].R()));
    }
    A.diagonal().array() += 1e-9;
    if (round == 0) bias_gyro = A.ldlt().solve(b);
  }
  double turned = 0;
  for (std::size_t k = 1; k < poses.size(); ++k)
    turned += logSO3(Eigen::Matrix3d(pre[k - 1].deltaR().transpose() * T_0_k[k].R())).squaredNorm();
  if (bias_gyro.norm() > 0.5 || std::sqrt(turned / static_cast<double>(poses.size() - 1)) > kWorstRotation) {
    result.reason = "gyro and camera rotations disagree; does something move before the camera?";
    return result;
  }

  // Unknowns (v_0, g, b_a); the bias is held by its prior, which short motions cannot beat.
  const auto solve = [&](const Eigen::Vector3d* g_fixed, Eigen::VectorXd* x, Eigen::MatrixXd* covariance,
                         Eigen::Matrix<double, 3, 2>* basis) {
    const int n_g = g_fixed ? 2 : 3;
    const int n = 6 + n_g;
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
    if (g_fixed) {
      const Eigen::Vector3d up = g_fixed->normalized();
      const Eigen::Vector3d helper = std::abs(up.x()) < 0.7 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
      basis->col(0) = up.cross(helper).normalized();
      basis->col(1) = up.cross(basis->col(0));
    }
    for (std::size_t k = 1; k < poses.size(); ++k) {
      const double t = pre[k - 1].dt();
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, n);
      J.leftCols(3) = t * Eigen::Matrix3d::Identity();
      J.middleCols(3, n_g) = -0.5 * t * t * Eigen::MatrixXd::Identity(3, n_g);
      if (g_fixed) J.middleCols(3, 2) = -0.5 * t * t * *basis;
      J.rightCols(3) = pre[k - 1].J_alpha_ba();
      Eigen::Vector3d r = T_0_k[k].t() - pre[k - 1].alpha();
      if (g_fixed) r += 0.5 * t * t * *g_fixed;
      A += J.transpose() * J / (kPositionSigma * kPositionSigma);
      b += J.transpose() * r / (kPositionSigma * kPositionSigma);
    }
    A.bottomRightCorner(3, 3).diagonal().array() += 1.0 / (options.sigma_bias_accel * options.sigma_bias_accel);
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(A);
    *x = ldlt.solve(b);
    *covariance = ldlt.solve(Eigen::MatrixXd::Identity(n, n));
    return x->allFinite();
  };
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
  Eigen::Matrix<double, 3, 2> basis;
  if (!solve(nullptr, &x, &covariance, &basis)) {
    result.reason = "velocity and gravity could not be solved";
    return result;
  }
  Eigen::Vector3d g = x.segment<3>(3);
  result.gravity_error = std::abs(g.norm() - gravity);
  g *= gravity / g.norm();
  for (int round = 0; round < 4; ++round) {
    if (!solve(&g, &x, &covariance, &basis)) {
      result.reason = "velocity and gravity could not be solved";
      return result;
    }
    g = (g + basis * x.segment<2>(3)).normalized() * gravity;
  }
  const Eigen::Vector3d v0 = x.head<3>();
  const Eigen::Vector3d bias_accel = x.tail<3>();
  double sum = 0;
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const double t = pre[k - 1].dt();
    sum += (v0 * t - 0.5 * g * t * t + pre[k - 1].alpha() + pre[k - 1].J_alpha_ba() * bias_accel - T_0_k[k].t())
               .squaredNorm();
  }
  result.rms_position = std::sqrt(sum / static_cast<double>(poses.size() - 1));
  if (result.rms_position > kWorstPosition) {
    result.reason = "camera and IMU motions disagree; does something move before the camera?";
    return result;
  }

  const Preintegration& whole = pre.back();
  const double t = whole.dt();
  const Eigen::Matrix3d R_0_k = T_0_k.back().R();
  const Eigen::Vector3d v_k = v0 - g * t + whole.beta() + whole.J_beta_ba() * bias_accel;  // first IMU frame
  FilterPrior& prior = result.prior;
  prior.state.t = poses.back().t_imu;
  const Eigen::Quaterniond q_W_k = gravityAlignedRotation(R_0_k.transpose() * g);
  prior.state.T_W_I = SE3(q_W_k, Eigen::Vector3d::Zero());
  prior.state.v_W = q_W_k * (R_0_k.transpose() * v_k);
  prior.state.bias_gyro = bias_gyro;
  prior.state.bias_accel = bias_accel;
  // What the poses are off by more than expected, their estimates may be off by more as well.
  const double worse = std::max(1.0, result.rms_position / kPositionSigma);
  const double sigma_gravity = worse * std::sqrt(covariance.block(3, 3, 2, 2).diagonal().maxCoeff());
  const double sigma_v0 = worse * std::sqrt(covariance.topLeftCorner(3, 3).diagonal().maxCoeff());
  prior.sigma_tilt = 0.01 + sigma_gravity / gravity;
  prior.sigma_velocity = 0.02 + sigma_v0 + t * sigma_gravity;
  prior.sigma_bias_gyro = std::min(options.sigma_bias_gyro, 0.002 + 0.004 / t);
  prior.sigma_bias_accel = options.sigma_bias_accel;
  result.ok = true;
  return result;
}

}  // namespace vip_slam
