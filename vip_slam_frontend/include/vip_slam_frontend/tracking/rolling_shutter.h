// A rolling shutter reads the rows of an image one after the other while the camera moves. What a feature's row saw is
// carried to the stamp, so that estimators need not know of rows. First order in the time between, a few milliseconds.
#pragma once

#include <Eigen/Core>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/types/feature.h"

namespace vip_slam {

class RollingShutter {
 public:
  /// A global shutter.
  RollingShutter() = default;
  /// `readout`: seconds from first to last of `rows`, stamp in the middle. `nav`: state at the stamp. `gyro`: rate
  /// measured there, rad/s, in the IMU's frame. `T_I_C`: camera into IMU.
  RollingShutter(double readout, int rows, const NavState& nav, const Eigen::Vector3d& gyro, const SE3& T_I_C);

  /// The feature's normalised image point as the camera at the stamp sees it. The feature's depth takes part when it is
  /// there; it is left as it is, since depth is rarely measured row by row with the colour image.
  Eigen::Vector2f atStamp(const Feature& feature) const;

 private:
  double seconds_per_row_ = 0, middle_row_ = 0;
  Eigen::Vector3d omega_C_ = Eigen::Vector3d::Zero(), v_C_ = Eigen::Vector3d::Zero();
};

}  // namespace vip_slam
