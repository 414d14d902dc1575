// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/row_camera.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/imu/imu_buffer.h"

namespace vip_slam {

namespace {

ImuSample sampleAt(const std::vector<ImuSample>& imu, double t) {
  const auto later =
      std::lower_bound(imu.begin(), imu.end(), t, [](const ImuSample& s, double at) { return s.t < at; });
  if (later == imu.end()) return imu.back();
  return later == imu.begin() ? imu.front() : interpolate(*(later - 1), *later, t);
}

}  // namespace

RowPoses::RowPoses(const Readout& readout, const NavState& nav, const std::vector<ImuSample>& imu, const SE3& T_I_C,
                   double gravity) {
  const double length = readout.last - readout.first;
  const int intervals = 2 * std::max(1, static_cast<int>(std::ceil(0.5 * std::abs(length) / kKnotSeconds)));
  knots_.resize(static_cast<std::size_t>(intervals + 1));
  const auto timeOf = [&](int k) { return readout.first + length * k / intervals; };
  const Eigen::Matrix3d R_I_C = T_I_C.R();
  const Eigen::Vector3d g_stamp = nav.T_W_I.R().transpose() * gravityVector(gravity);
  const Eigen::Vector3d v_stamp = nav.T_W_I.R().transpose() * nav.v_W;
  int later = 0;  // the first knot that is not before the stamp
  while (later <= intervals && timeOf(later) * length < 0) ++later;
  // Integrates from the stamp in both directions: body pose at a knot relative to the stamp, converted to the camera.
  const auto march = [&](int begin, int end, int way) {
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = v_stamp;
    double at = 0;
    for (int k = begin; k != end; k += way) {
      const double to = timeOf(k);
      const int steps = static_cast<int>(std::ceil(std::abs(to - at) / kKnotSeconds - 1e-9));
      const double dt = steps > 0 ? (to - at) / steps : 0.0;
      for (int i = 0; i < steps; ++i) {
        const ImuSample middle = sampleAt(imu, nav.t + at + (i + 0.5) * dt);
        const Eigen::Vector3d omega = middle.gyro - nav.bias_gyro;
        const Eigen::Matrix3d half_step = expSO3(Eigen::Vector3d(omega * 0.5 * dt));
        const Eigen::Vector3d a = R * half_step * (middle.accel - nav.bias_accel) - g_stamp;
        p += v * dt + 0.5 * a * dt * dt;
        v += a * dt;
        R = R * expSO3(Eigen::Vector3d(omega * dt));
      }
      at = to;
      knots_[static_cast<std::size_t>(k)] = {R_I_C.transpose() * R * R_I_C,
                                             R_I_C.transpose() * (R * T_I_C.t() + p - T_I_C.t())};
    }
  };
  march(later, intervals + 1, 1);
  march(later - 1, -1, -1);
}

void RowPoses::at(double share, Eigen::Matrix3d* R, Eigen::Vector3d* t) const {
  const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(knots_.size() - 1);
  const std::size_t k = std::min(static_cast<std::size_t>(place), knots_.size() - 2);
  const double b = place - static_cast<double>(k), a = 1.0 - b;
  *R = a * knots_[k].R + b * knots_[k + 1].R;
  *t = a * knots_[k].t + b * knots_[k + 1].t;
}

bool RowCamera::project(const Eigen::Vector3d& p_stamp, Eigen::Vector2d* uv) const {
  if (!camera_->project(p_stamp, uv)) return false;
  if (!rows_) return true;
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
  // Fixed-point iteration: the row moves by a few per cent of the image motion during readout, so each turn leaves a
  // few per cent of the error.
  for (int turn = 0; turn < 4; ++turn) {
    rows_->at(share(uv->y()), &R, &t);
    if (!camera_->project(R.transpose() * (p_stamp - t), uv)) return false;
  }
  return true;
}

Eigen::Vector3d RowCamera::unproject(const Eigen::Vector2d& uv, double z) const {
  if (!rows_) return camera_->unproject(uv, z);
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
  rows_->at(share(uv.y()), &R, &t);
  const Eigen::Vector3d ray = R * camera_->unproject(uv, 1.0);
  return ray * ((z - t.z()) / ray.z()) + t;
}

}  // namespace vip_slam
