#include "vip_slam_frontend/tracking/row_camera.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/imu/imu_buffer.h"

namespace vip_slam {

namespace {

// Between knots poses are interpolated linearly: at 5 rad/s a millisecond leaves 3e-6 rad.
constexpr double kKnotSeconds = 1e-3;

ImuSample sampleAt(const std::vector<ImuSample>& imu, double t) {
  const auto later =
      std::lower_bound(imu.begin(), imu.end(), t, [](const ImuSample& s, double at) { return s.t < at; });
  if (later == imu.end()) return imu.back();
  return later == imu.begin() ? imu.front() : interpolate(*(later - 1), *later, t);
}

}  // namespace

RowPoses::RowPoses(double readout, const NavState& nav, const std::vector<ImuSample>& imu, const SE3& T_I_C,
                   double gravity) {
  const int half = std::max(1, static_cast<int>(std::ceil(0.5 * readout / kKnotSeconds)));
  knots_.resize(static_cast<std::size_t>(2 * half + 1));
  const Eigen::Matrix3d R_I_C = T_I_C.R();
  const Eigen::Vector3d g_stamp = nav.T_W_I.R().transpose() * gravityVector(gravity);
  const auto knot = [&](int k, const Eigen::Matrix3d& R, const Eigen::Vector3d& p) {
    // Body at the row seen from the body at the stamp, turned into cameras.
    knots_[static_cast<std::size_t>(half + k)] = {R_I_C.transpose() * R * R_I_C,
                                                  R_I_C.transpose() * (R * T_I_C.t() + p - T_I_C.t())};
  };
  const double h = 0.5 * readout / half;
  for (const int way : {-1, 1}) {
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = nav.T_W_I.R().transpose() * nav.v_W;
    knot(0, R, p);
    for (int k = 1; k <= half; ++k) {
      const double dt = way * h;
      const ImuSample middle = sampleAt(imu, nav.t + (k - 0.5) * dt);
      const Eigen::Matrix3d step = expSO3(Eigen::Vector3d((middle.gyro - nav.bias_gyro) * dt));
      const Eigen::Vector3d a =
          R * expSO3(Eigen::Vector3d((middle.gyro - nav.bias_gyro) * 0.5 * dt)) * (middle.accel - nav.bias_accel) -
          g_stamp;
      p += v * dt + 0.5 * a * dt * dt;
      v += a * dt;
      R = R * step;
      knot(way * k, R, p);
    }
  }
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
  // Rows move by a few per cent of what the image moves while it is read, so each turn leaves a few per cent.
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
