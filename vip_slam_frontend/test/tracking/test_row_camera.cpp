// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "distorted_camera.h"
#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_frontend/tracking/row_camera.h"

namespace vip_slam {
namespace {

std::shared_ptr<const CameraModel> largeCamera() { return distortedCamera(640, 480, 500); }

/// A body that oscillates about all axes and along them, 2 rad/s and 15 rad/s^2 at most, and its IMU.
struct Swing {
  SE3 T_I_C = SE3(expSO3(Eigen::Vector3d(0.3, -1.2, 0.5)), Eigen::Vector3d(0.05, -0.03, 0.08));
  Eigen::Vector3d bias_gyro = {0.01, -0.02, 0.03}, bias_accel = {0.1, 0.05, -0.2};
  Eigen::Vector3d axis = Eigen::Vector3d(0.5, -0.7, 0.4).normalized(), along = {0.8, -0.5, 0.3};

  double angle(double t) const { return 2.0 / 7.5 * std::sin(7.5 * t + 0.6); }
  SE3 T_W_I(double t) const {
    return SE3(Eigen::Matrix3d(expSO3(Eigen::Vector3d(0.2, 0.4, -1.0)) * expSO3(Eigen::Vector3d(axis * angle(t)))),
               Eigen::Vector3d(1, 2, 3) + along * (0.2 * std::sin(5 * t + 0.9)));
  }
  /// By differences of the motion, so that it is independent of the code under test.
  NavState nav(double t) const {
    NavState x;
    x.t = t;
    x.T_W_I = T_W_I(t);
    x.v_W = (T_W_I(t + 1e-5).t() - T_W_I(t - 1e-5).t()) / 2e-5;
    x.bias_gyro = bias_gyro;
    x.bias_accel = bias_accel;
    return x;
  }
  ImuSample sample(double t) const {
    ImuSample s;
    s.t = t;
    const double h = 1e-3;
    s.gyro = logSO3(Eigen::Quaterniond(Eigen::Matrix3d(T_W_I(t - h).R().transpose() * T_W_I(t + h).R()))) / (2 * h) +
             bias_gyro;
    const Eigen::Vector3d a_W = (T_W_I(t + h).t() - 2 * T_W_I(t).t() + T_W_I(t - h).t()) / (h * h);
    s.accel = T_W_I(t).R().transpose() * (a_W + gravityVector()) + bias_accel;
    return s;
  }
  std::vector<ImuSample> imu(double t0, double t1) const {
    std::vector<ImuSample> list;
    for (double t = t0; t <= t1 + 1e-9; t += 0.005) list.push_back(sample(t));
    return list;
  }
  /// The pixel whose row, at its time, sees the point.
  Eigen::Vector2d seenByItsRow(double t, const Eigen::Vector3d& p_W, double readout = kReadout) const {
    Eigen::Vector2d uv(0, 239.5);
    for (int k = 0; k < 30; ++k) {
      const double at = t + readout * ((uv.y() + 0.5) / 480 - 0.5);
      EXPECT_TRUE(largeCamera()->project((T_W_I(at) * T_I_C).inverse() * p_W, &uv));
    }
    return uv;
  }
};

TEST(RowCamera, EveryRowAgreesWithTheMotionThere) {
  const Swing swing;
  double most_apart = 0;
  for (double t : {0.2, 0.5, 1.1}) {
    const RowCamera view(largeCamera(), std::make_shared<RowPoses>(Readout::around(kReadout), swing.nav(t),
                                                                   swing.imu(t - 0.01, t + 0.01), swing.T_I_C));
    const SE3 T_W_C = swing.T_W_I(t) * swing.T_I_C;
    for (double x = -0.5; x <= 0.5; x += 0.25) {
      for (double y = -0.4; y <= 0.4; y += 0.1) {
        for (double z : {0.8, 2.0, 5.0}) {
          const Eigen::Vector3d p(x * z, y * z, z);
          const Eigen::Vector2d truth = swing.seenByItsRow(t, T_W_C * p);
          Eigen::Vector2d uv, global;
          ASSERT_TRUE(view.project(p, &uv));
          ASSERT_TRUE(largeCamera()->project(p, &global));
          most_apart = std::max(most_apart, (truth - global).norm());
          EXPECT_LT((uv - truth).norm(), 0.01) << t << ": " << x << " " << y << " " << z;
          EXPECT_LT((view.unproject(truth, z) - p).norm(), 2e-5 * z) << t << ": " << x << " " << y << " " << z;
        }
      }
    }
  }
  EXPECT_GT(most_apart, 8.0);
}

/// An image that is turned round.
TEST(RowCamera, TheLastRowMayComeFirst) {
  const Swing swing;
  const RowCamera view(largeCamera(), std::make_shared<RowPoses>(Readout::around(-kReadout), swing.nav(0.5),
                                                                 swing.imu(0.49, 0.51), swing.T_I_C));
  const SE3 T_W_C = swing.T_W_I(0.5) * swing.T_I_C;
  for (double y : {-0.4, 0.3}) {  // far from the middle row, where both are one moment
    const Eigen::Vector3d p(0.5, 2 * y, 2.0);
    const Eigen::Vector2d truth = swing.seenByItsRow(0.5, T_W_C * p, -kReadout);
    EXPECT_GT((truth - swing.seenByItsRow(0.5, T_W_C * p)).norm(), 1.0);
    Eigen::Vector2d uv;
    ASSERT_TRUE(view.project(p, &uv));
    EXPECT_LT((uv - truth).norm(), 0.01) << y;
  }
}

TEST(RowCamera, BeyondTheImuItsLastSampleCounts) {
  const Swing swing;
  const double t = 0.5;
  const RowPoses all(Readout::around(kReadout), swing.nav(t), swing.imu(t - 0.01, t + 0.01), swing.T_I_C);
  const RowPoses half(Readout::around(kReadout), swing.nav(t), swing.imu(t - 0.01, t), swing.T_I_C);
  Eigen::Matrix3d R_all, R_half;
  Eigen::Vector3d t_all, t_half;
  all.at(1.0, &R_all, &t_all);
  half.at(1.0, &R_half, &t_half);
  EXPECT_LT((R_all - R_half).norm(), 3e-3);
  EXPECT_LT((t_all - t_half).norm(), 1e-3);
  all.at(0.5, &R_all, &t_all);
  EXPECT_LT((R_all - Eigen::Matrix3d::Identity()).norm() + t_all.norm(), 1e-12);
}

TEST(RowCamera, AGlobalShutterIsTheCamera) {
  const RowCamera view(largeCamera());
  EXPECT_FALSE(view.rolls());
  const Eigen::Vector3d p(0.3, -0.2, 1.5);
  Eigen::Vector2d uv, same;
  ASSERT_TRUE(view.project(p, &uv));
  ASSERT_TRUE(largeCamera()->project(p, &same));
  EXPECT_EQ(uv, same);
  EXPECT_LT((view.unproject(uv, 1.5) - p).norm(), 1e-9);
}

}  // namespace
}  // namespace vip_slam
