// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/motion/spline_trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr int kOrder = 6;
using Weights = std::array<double, kOrder>;

/// Blending polynomials of the uniform B-spline: weight of control point s is sum_n m[s][n] u^n.
struct Blending {
  double m[kOrder][kOrder];
  Blending() {
    const auto choose = [](int n, int k) {
      double c = 1;
      for (int i = 1; i <= k; ++i) c = c * (n - k + i) / i;
      return c;
    };
    double factorial = 1;
    for (int i = 2; i < kOrder; ++i) factorial *= i;
    for (int s = 0; s < kOrder; ++s)
      for (int n = 0; n < kOrder; ++n) {
        double sum = 0;
        for (int l = s; l < kOrder; ++l)
          sum += ((l - s) % 2 ? -1 : 1) * choose(kOrder, l - s) * std::pow(kOrder - 1 - l, kOrder - 1 - n);
        m[s][n] = choose(kOrder - 1, n) / factorial * sum;
      }
  }
  /// Values and first two derivatives in u.
  void evaluate(double u, Weights* w, Weights* w1, Weights* w2) const {
    for (int s = 0; s < kOrder; ++s) {
      double a = 0, b = 0, c = 0;
      for (int n = kOrder - 1; n >= 0; --n) {
        a = a * u + m[s][n];
        if (n >= 1) b = b * u + n * m[s][n];
        if (n >= 2) c = c * u + n * (n - 1) * m[s][n];
      }
      (*w)[s] = a;
      (*w1)[s] = b;
      (*w2)[s] = c;
    }
  }
};

const Blending& blending() {
  static const Blending b;
  return b;
}

}  // namespace

SplineTrajectory::SplineTrajectory(double begin, double spacing, std::vector<SE3> control)
    : begin_(begin), spacing_(spacing), control_(std::move(control)) {
  if (control_.size() < kOrder)
    throw std::invalid_argument(
        formatted("spline: %zu control poses, expected at least %zu", control_.size(), std::size_t{kOrder}));
  if (!(spacing_ > 0))
    throw std::invalid_argument(formatted("spline: spacing is %g s, expected more than 0", spacing_));
  for (std::size_t i = 0; i + 1 < control_.size(); ++i)
    steps_.push_back(logSO3(control_[i].rotation().conjugate() * control_[i + 1].rotation()));
}

MotionState SplineTrajectory::at(double t) const {
  MotionState m = smooth(t);
  if (!vibration_) return m;
  // Displacement and turn are small and in the body's frame: exact but for the turn's second order (1e-7 rad).
  const VibrationState s = vibration_->at(t);
  const Eigen::Vector3d& o = m.omega_I;
  const Eigen::Matrix3d R = m.T_W_I.R();
  const SE3 T_W_I(m.T_W_I.rotation() * expQuaternion(s.turn), m.T_W_I.t() + R * s.p);
  m.v_W += R * (o.cross(s.p) + s.v);
  m.a_W += R * (m.alpha_I.cross(s.p) + o.cross(o.cross(s.p)) + 2 * o.cross(s.v) + s.a);
  m.alpha_I += m.alpha_I.cross(s.turn) + o.cross(s.rate) + s.acceleration;
  m.omega_I += o.cross(s.turn) + s.rate;
  m.T_W_I = T_W_I;
  return m;
}

MotionState SplineTrajectory::smooth(double t) const {
  const double s = std::clamp((t - begin_) / spacing_, 0.0, static_cast<double>(control_.size() - 5));
  const auto i = std::min<std::size_t>(static_cast<std::size_t>(s), control_.size() - kOrder);
  const double u = s - static_cast<double>(i), r = 1 / spacing_;
  Weights w, w1, w2;
  blending().evaluate(u, &w, &w1, &w2);

  MotionState out;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  out.v_W = out.a_W = p;
  for (int k = 0; k < kOrder; ++k) {
    p += w[k] * control_[i + k].t();
    out.v_W += r * w1[k] * control_[i + k].t();
    out.a_W += r * r * w2[k] * control_[i + k].t();
  }
  // Cumulative weights are sums from k on.
  Weights c{}, c1{}, c2{};
  for (int k = kOrder - 1; k >= 0; --k) {
    c[k] = w[k] + (k + 1 < kOrder ? c[k + 1] : 0);
    c1[k] = w1[k] + (k + 1 < kOrder ? c1[k + 1] : 0);
    c2[k] = w2[k] + (k + 1 < kOrder ? c2[k + 1] : 0);
  }
  Eigen::Quaterniond q = control_[i].rotation();
  Eigen::Vector3d omega = Eigen::Vector3d::Zero(), alpha = omega;
  for (int k = 1; k < kOrder; ++k) {
    const Eigen::Vector3d& d = steps_[i + k - 1];
    const Eigen::Quaterniond A = expQuaternion(c[k] * d);
    q = q * A;
    omega = A.conjugate() * omega + r * c1[k] * d;
    alpha = A.conjugate() * alpha + r * c1[k] * omega.cross(d) + r * r * c2[k] * d;
  }
  out.T_W_I = SE3(q, p);
  out.omega_I = omega;
  out.alpha_I = alpha;
  return out;
}

SplineTrajectory SplineTrajectory::fit(const Trajectory& poses, double spacing, int iterations) {
  if (poses.size() < 2)
    throw std::invalid_argument(formatted("spline fit: %zu poses, expected at least 2", poses.size()));
  const double t0 = poses.front().t, t1 = poses.back().t;
  const int spans = std::max(1, static_cast<int>(std::ceil((t1 - t0) / spacing - 1e-9)));
  const auto target = [&](double t) {
    t = std::clamp(t, t0, t1);
    auto it = std::lower_bound(poses.begin(), poses.end(), t, [](const StampedPose& p, double v) { return p.t < v; });
    if (it == poses.begin()) return it->T_W_B;
    if (it == poses.end()) return poses.back().T_W_B;
    const StampedPose& a = *(it - 1);
    return interpolate(a.T_W_B, it->T_W_B, (t - a.t) / (it->t - a.t));
  };
  // Control pose k acts around t0 + (k - 2) spacing.
  std::vector<SE3> goal, control;
  for (int k = 0; k < spans + 5; ++k) goal.push_back(target(t0 + (k - 2) * spacing));
  control = goal;
  for (int n = 0; n < iterations; ++n) {
    const SplineTrajectory now(t0, spacing, control);
    for (int k = 0; k < spans + 5; ++k) {
      const SE3 reached = now.at(t0 + (k - 2) * spacing).T_W_I;
      const Vector6d residual = goal[k].boxminus(reached);
      // Control poses beyond the ends, where at() clamps its time, are corrected by the residual at the end.
      control[k] = control[k].boxplus(0.9 * residual);
    }
  }
  return SplineTrajectory(t0, spacing, control);
}

}  // namespace vip_slam
