// Visual-inertial alignment for a start in motion, with metric camera poses (their scale comes from depth):
//   gyro bias:  J_theta_bg b_g = Log(dR_k^T R_0_k)
//   p_k - p_0 = v_0 t_k - g t_k^2 / 2 + alpha_k + J_alpha_ba b_a,  |g| known, all in the first IMU frame.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/imu/imu_buffer.h"
#include "vip_slam_frontend/filter/vio_filter.h"

namespace vip_slam {

struct TimedCameraPose {
  double t_imu = 0;
  SE3 T_first_C;  ///< camera pose in the frame of the first camera
};

struct MovingStart {
  bool ok = false;
  std::string reason;        ///< when not ok
  FilterPrior prior;         ///< at the last pose's time; yaw and position zero there
  double gravity_error = 0;  ///< | |g| - gravity | before the constraint, m/s^2
  double rms_position = 0;   ///< m, of the fit
};

MovingStart solveMovingStart(const std::vector<TimedCameraPose>& poses, const ImuBuffer& imu, const SE3& T_I_C,
                             const ImuNoise& noise, const FilterOptions& options, double gravity,
                             const Eigen::Matrix3d& gyro_correction = Eigen::Matrix3d::Zero());

}  // namespace vip_slam
