#include "vip_slam_frontend/tracking/rolling_shutter.h"

namespace vip_slam {

RollingShutter::RollingShutter(double readout, int rows, const NavState& nav, const Eigen::Vector3d& gyro,
                               const SE3& T_I_C)
    : seconds_per_row_(readout / rows), middle_row_(0.5 * (rows - 1)) {
  const Eigen::Vector3d omega_I = gyro - nav.bias_gyro;
  const Eigen::Vector3d v_I = nav.T_W_I.R().transpose() * nav.v_W + omega_I.cross(T_I_C.t());
  omega_C_ = T_I_C.R().transpose() * omega_I;
  v_C_ = T_I_C.R().transpose() * v_I;
}

Eigen::Vector2f RollingShutter::atStamp(const Feature& feature) const {
  if (seconds_per_row_ == 0) return feature.xy;
  const double dt = (feature.pixel.y() - middle_row_) * seconds_per_row_;
  const Eigen::Vector3d ray(feature.xy.x(), feature.xy.y(), 1.0);
  Eigen::Vector3d p = ray + dt * omega_C_.cross(ray);
  if (feature.depth > 0) p += dt / feature.depth * v_C_;
  return (p.head<2>() / p.z()).cast<float>();
}

}  // namespace vip_slam
