#include <gtest/gtest.h>

#include <cmath>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_frontend/tracking/rolling_shutter.h"

namespace vip_slam {
namespace {

constexpr double kFocal = 500, kCx = 319.5, kCy = 239.5, kReadout = 0.02;
constexpr int kRows = 480;

/// A body that turns and moves steadily: exact pose at a time after the stamp.
struct Motion {
  NavState nav;
  Eigen::Vector3d omega_I = {0.5, -0.7, 0.4};
  SE3 T_I_C = SE3(expSO3(Eigen::Vector3d(0.3, -1.2, 0.5)), Eigen::Vector3d(0.05, -0.03, 0.08));

  Motion() {
    nav.T_W_I = SE3(expSO3(Eigen::Vector3d(0.2, 0.4, -1.0)), Eigen::Vector3d(1, 2, 3));
    nav.v_W = {0.8, -0.5, 0.3};
    nav.bias_gyro = {0.01, -0.02, 0.03};
  }
  SE3 T_W_C(double dt) const {
    const SE3 T_W_I(Eigen::Matrix3d(nav.T_W_I.R() * expSO3(Eigen::Vector3d(omega_I * dt))),
                    nav.T_W_I.t() + nav.v_W * dt);
    return T_W_I * T_I_C;
  }
};

Eigen::Vector2d normalised(const Eigen::Vector3d& p) { return p.head<2>() / p.z(); }

/// What the row that sees the point sees: fixed point of row = projection at the row's time.
Feature seenByItsRow(const Motion& motion, const Eigen::Vector3d& p_W) {
  Eigen::Vector3d p;
  double v = kCy;
  for (int k = 0; k < 20; ++k) {
    const double dt = kReadout * ((v + 0.5) / kRows - 0.5);
    p = motion.T_W_C(dt).inverse() * p_W;
    v = kFocal * p.y() / p.z() + kCy;
  }
  Feature f;
  f.xy = normalised(p).cast<float>();
  f.pixel = Eigen::Vector2f(float(kFocal * p.x() / p.z() + kCx), float(v));
  f.depth = static_cast<float>(p.z());
  return f;
}

TEST(RollingShutter, CarriesEveryRowToTheStamp) {
  const Motion motion;
  const RollingShutter shutter(kReadout, kRows, motion.nav, motion.omega_I + motion.nav.bias_gyro, motion.T_I_C);
  double most_before = 0;
  for (double x = -0.6; x <= 0.6; x += 0.3) {
    for (double y = -0.45; y <= 0.45; y += 0.15) {
      for (double z : {0.8, 2.0, 5.0}) {
        const Eigen::Vector3d p_W = motion.T_W_C(0) * Eigen::Vector3d(x * z, y * z, z);
        const Feature f = seenByItsRow(motion, p_W);
        most_before = std::max(most_before, kFocal * (f.xy.cast<double>() - Eigen::Vector2d(x, y)).norm());
        const double after = kFocal * (shutter.atStamp(f).cast<double>() - Eigen::Vector2d(x, y)).norm();
        EXPECT_LT(after, 0.06) << x << " " << y << " " << z;  // second order, px
      }
    }
  }
  EXPECT_GT(most_before, 5.0);
}

TEST(RollingShutter, WithoutDepthTheRotationIsTakenOut) {
  Motion motion;
  motion.nav.v_W.setZero();
  motion.T_I_C = SE3(motion.T_I_C.R(), Eigen::Vector3d::Zero());
  const RollingShutter shutter(kReadout, kRows, motion.nav, motion.omega_I + motion.nav.bias_gyro, motion.T_I_C);
  Feature f = seenByItsRow(motion, motion.T_W_C(0) * Eigen::Vector3d(1, -1, 3));
  f.depth = 0;
  EXPECT_LT(kFocal * (shutter.atStamp(f).cast<double>() - Eigen::Vector2d(1 / 3., -1 / 3.)).norm(), 0.06);
}

TEST(RollingShutter, AGlobalShutterChangesNothing) {
  Feature f;
  f.xy = {0.25f, -0.125f};
  f.pixel = {400.f, 20.f};
  f.depth = 2;
  EXPECT_EQ(RollingShutter().atStamp(f), f.xy);
}

}  // namespace
}  // namespace vip_slam
