// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/window_state.h"

namespace vip_slam {

std::pair<int, int> gyroEntry(const CalibrationFlags& calibration, int index) {
  if (calibration.gyro_scale && index < 3) return {index, index};
  const int beside = index - (calibration.gyro_scale ? 3 : 0), row = beside / 2;
  return {row, (row + 1 + beside % 2) % 3};
}

int WindowState::indexOf(CloneId id) const {
  for (std::size_t i = 0; i < clones.size(); ++i) {
    if (clones[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

NavState WindowState::nav() const {
  NavState nav;
  nav.t = clones.back().t;
  nav.T_W_I = clones.back().T_W_I;
  nav.v_W = v_W;
  nav.bias_gyro = bias_gyro;
  nav.bias_accel = bias_accel;
  return nav;
}

void WindowState::boxplus(const Eigen::VectorXd& delta) {
  for (std::size_t i = 0; i < clones.size(); ++i) {
    clones[i].T_W_I = clones[i].T_W_I.boxplus(delta.segment<6>(cloneColumn(static_cast<int>(i))));
  }
  Vector6d extrinsic = Vector6d::Zero();
  if (calibration.rotation) extrinsic.head<3>() = delta.segment<3>(rotationColumn());
  if (calibration.translation) extrinsic.tail<3>() = delta.segment<3>(translationColumn());
  if (calibration.rotation || calibration.translation) T_I_C = T_I_C.boxplus(extrinsic);
  if (calibration.time_offset) time_offset += delta(timeOffsetColumn());
  if (calibration.depth_offset) depth_offset += delta(depthOffsetColumn());
  if (calibration.depth_scale) depth_scale += delta(depthScaleColumn());
  if (calibration.depth_delay) depth_delay += delta(depthDelayColumn());
  if (calibration.readout) readout += delta(readoutColumn());
  if (calibration.intrinsics) bearing.value += delta.segment<4>(intrinsicsColumn());
  if (calibration.depth_shift) depth_shift += delta.segment<2>(depthShiftColumn());
  for (int k = 0; k < calibration.gyro(); ++k) {
    const auto [row, column] = gyroEntry(calibration, k);
    gyro_correction(row, column) += delta(gyroColumn() + k);
  }
  v_W += delta.segment<3>(navColumn());
  bias_gyro += delta.segment<3>(navColumn() + 3);
  bias_accel += delta.segment<3>(navColumn() + 6);
}

bool WindowState::isFinite() const {
  for (const Clone& clone : clones) {
    if (!clone.T_W_I.isFinite()) return false;
  }
  return v_W.allFinite() && bias_gyro.allFinite() && bias_accel.allFinite() && T_I_C.isFinite() &&
         std::isfinite(time_offset) && std::isfinite(depth_offset) && std::isfinite(depth_scale) &&
         std::isfinite(depth_delay) && std::isfinite(readout) && bearing.value.allFinite() && depth_shift.allFinite() &&
         gyro_correction.allFinite();
}

}  // namespace vip_slam
