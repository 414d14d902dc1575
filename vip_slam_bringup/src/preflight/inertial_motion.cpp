// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/preflight/inertial_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr double kWindow = 1.5;             // s: longer than a sway, too short for errors of attitude to matter
constexpr double kMaxGap = 0.05;            // s between samples of the IMU
constexpr std::size_t kMinSteps = 8;        // in a window
constexpr std::size_t kMinWindows = 4;      // for a result
constexpr std::size_t kMinWindowsHalf = 2;  // in each half, for it to have an opinion
constexpr int kBases = 10;                  // entries of P column by column, then the arm

using Gram = Eigen::Matrix<double, kBases, kBases>;
using Row = Eigen::Matrix<double, kBases, 1>;

/// The samples as a function of time, linear in between.
class Samples {
 public:
  explicit Samples(const std::vector<StampedVector>& all) {
    for (const StampedVector& s : all)
      if (s.value.allFinite() && (list_.empty() || s.t > list_.back().t)) list_.push_back(s);
  }
  const std::vector<StampedVector>& list() const { return list_; }
  /// False where there is none within kMaxGap on both sides.
  bool at(double t, Eigen::Vector3d* value) const {
    const auto after =
        std::lower_bound(list_.begin(), list_.end(), t, [](const StampedVector& s, double x) { return s.t < x; });
    if (after == list_.end() || after == list_.begin() || after->t - (after - 1)->t > kMaxGap) return false;
    const double share = (t - (after - 1)->t) / (after->t - (after - 1)->t);
    *value = (1 - share) * (after - 1)->value + share * after->value;
    return true;
  }

 private:
  std::vector<StampedVector> list_;
};

/// What the IMU says of a window: rotation, and the double integrals of each axis of the accelerometer.
class Dead {
 public:
  /// False where samples are missing. `bias` of the gyro.
  bool run(const Samples& gyro, const Samples& accel, const Eigen::Vector3d& bias, double from, double to) {
    const int n = std::max(2, int(std::ceil((to - from) / kStep)));
    begin_ = from, h_ = (to - from) / n;
    turn_.assign(1, Eigen::Matrix3d::Identity());
    place_.assign(1, Eigen::Matrix<double, 3, 9>::Zero());
    Eigen::Matrix<double, 3, 9> speed = place_.front();
    for (int i = 0; i < n; ++i) {
      Eigen::Vector3d w, a;
      const double t = from + (i + 0.5) * h_;
      if (!gyro.at(t, &w) || !accel.at(t, &a)) return false;
      w -= bias;
      const Eigen::Matrix3d middle = turn_.back() * expSO3(Eigen::Vector3d(0.5 * h_ * w));
      Eigen::Matrix<double, 3, 9> force;
      for (int axis = 0; axis < 3; ++axis) force.middleCols<3>(3 * axis) = middle * a(axis);
      place_.push_back(place_.back() + h_ * speed + 0.5 * h_ * h_ * force);
      speed += h_ * force;
      turn_.push_back(turn_.back() * expSO3(Eigen::Vector3d(h_ * w)));
    }
    return true;
  }
  Eigen::Matrix3d turn(double t) const {
    double share;
    const int i = index(t, &share);
    return turn_[i] * expSO3(Eigen::Vector3d(share * logSO3(Eigen::Matrix3d(turn_[i].transpose() * turn_[i + 1]))));
  }
  Eigen::Matrix<double, 3, 9> place(double t) const {
    double share;
    const int i = index(t, &share);
    return (1 - share) * place_[i] + share * place_[i + 1];
  }

 private:
  static constexpr double kStep = 0.0025;  // s
  int index(double t, double* share) const {
    const double x = std::clamp((t - begin_) / h_, 0.0, double(turn_.size() - 1) - 1e-9);
    *share = x - std::floor(x);
    return int(x);
  }
  double begin_ = 0, h_ = 1;
  std::vector<Eigen::Matrix3d> turn_;
  std::vector<Eigen::Matrix<double, 3, 9>> place_;
};

/// A window's velocities and what the bases say of them.
struct Window {
  std::vector<double> t;
  std::vector<Eigen::Vector3d> speed;
  std::vector<Eigen::Matrix<double, 3, kBases>> bases;
  std::vector<bool> use;

  /// Both without mean and trend, over the steps in use.
  void detrended(Eigen::MatrixX3d* v, std::vector<Eigen::MatrixX3d>* b) const {
    const int n = int(std::count(use.begin(), use.end(), true));
    Eigen::MatrixXd line(n, 2);
    *v = Eigen::MatrixX3d(n, 3);
    b->assign(kBases, *v);
    for (std::size_t i = 0, k = 0; i < t.size(); ++i) {
      if (!use[i]) continue;
      line.row(k) << 1, t[i];
      v->row(k) = speed[i].transpose();
      for (int c = 0; c < kBases; ++c) (*b)[c].row(k) = bases[i].col(c).transpose();
      ++k;
    }
    const Eigen::MatrixXd inverse = (line.transpose() * line).inverse() * line.transpose();
    *v -= (line * (inverse * *v)).eval();
    for (Eigen::MatrixX3d& base : *b) base -= (line * (inverse * base)).eval();
  }
};

/// Sums of one window: cost of any P and k is vv - 2 k p'b + k^2 p'Gp.
struct Sums {
  Gram G = Gram::Zero();
  Row b = Row::Zero();
  double vv = 0;
  void operator+=(const Sums& other) { G += other.G, b += other.b, vv += other.vv; }
};

Sums sumsOf(const Window& window) {
  Eigen::MatrixX3d v;
  std::vector<Eigen::MatrixX3d> bases;
  window.detrended(&v, &bases);
  Sums s;
  s.vv = v.squaredNorm();
  for (int i = 0; i < kBases; ++i) {
    s.b(i) = (bases[i].array() * v.array()).sum();
    for (int j = 0; j < kBases; ++j) s.G(i, j) = (bases[i].array() * bases[j].array()).sum();
  }
  return s;
}

Row rowOf(const Eigen::Matrix3d& P) {
  Row row;
  row << P.col(0), P.col(1), P.col(2), 1;
  return row;
}

struct Match {
  double k = 0, cost = 0;
};

Match match(const Sums& s, const Eigen::Matrix3d& P) {
  const Row row = rowOf(P);
  const double pp = row.dot(s.G * row), pb = row.dot(s.b);
  if (!(pp > 0) || pb <= 0) return {0, s.vv};
  return {pb / pp, std::max(0.0, s.vv - pb * pb / pp)};
}

std::vector<Eigen::Matrix3d> signedPermutations() {
  std::vector<Eigen::Matrix3d> all;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d P = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i) P(i, order[i]) = signs & (1 << i) ? -1 : 1;
      all.push_back(P);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

/// The P with the least cost; `second`: the next one's.
Eigen::Matrix3d best(const Sums& s, double* first, double* second) {
  Eigen::Matrix3d out = Eigen::Matrix3d::Identity();
  *first = *second = s.vv;
  for (const Eigen::Matrix3d& P : signedPermutations()) {
    const double cost = match(s, P).cost;
    if (cost < *first) {
      *second = *first;
      *first = cost, out = P;
    } else {
      *second = std::min(*second, cost);
    }
  }
  return out;
}

/// Leaves out steps that are off by more than three times the typical: a blurred image, a body that moves.
void trim(const Eigen::Matrix3d& P, double k, std::vector<Window>* windows) {
  const Row row = k * rowOf(P);
  std::vector<std::vector<double>> errors;
  std::vector<double> all;
  for (const Window& window : *windows) {
    Window whole = window;
    std::fill(whole.use.begin(), whole.use.end(), true);
    Eigen::MatrixX3d v;
    std::vector<Eigen::MatrixX3d> bases;
    whole.detrended(&v, &bases);
    for (int c = 0; c < kBases; ++c) v -= row(c) * bases[c];
    errors.emplace_back();
    for (int i = 0; i < v.rows(); ++i) errors.back().push_back(v.row(i).norm());
    all.insert(all.end(), errors.back().begin(), errors.back().end());
  }
  const double limit = 3 * upperMedian(all) + 1e-6;
  for (std::size_t w = 0; w < windows->size(); ++w) {
    std::vector<bool>& use = (*windows)[w].use;
    for (std::size_t i = 0; i < use.size(); ++i) use[i] = errors[w][i] <= limit;
  }
  windows->erase(std::remove_if(windows->begin(), windows->end(),
                                [](const Window& w) {
                                  return std::size_t(std::count(w.use.begin(), w.use.end(), true)) < kMinSteps;
                                }),
                 windows->end());
}

std::vector<Window> windowsOf(const ReadoutEstimate& motion, const std::vector<StampedVector>& gyro,
                              const std::vector<StampedVector>& accel, const Eigen::Vector3d& arm) {
  const Samples turning(gyro), forces(accel);
  const Eigen::Matrix3d R_imu_cam = motion.R_imu_cam.toRotationMatrix();
  std::vector<Window> windows;
  for (std::size_t begin = 0; begin < motion.fits.size();) {
    const double from = motion.fits[begin].t0;
    std::size_t end = begin;
    while (end < motion.fits.size() && motion.fits[end].t1 > from && motion.fits[end].t1 < from + kWindow) ++end;
    Dead imu;
    if (end - begin >= kMinSteps && imu.run(turning, forces, motion.gyro_bias, from, motion.fits[end - 1].t1)) {
      Window window;
      for (std::size_t i = begin; i < end; ++i) {
        const StepFit& fit = motion.fits[i];
        const double dt = fit.t1 - fit.t0;
        Eigen::Matrix<double, 3, kBases> bases;
        bases << (imu.place(fit.t1) - imu.place(fit.t0)) / dt, (imu.turn(fit.t1) - imu.turn(fit.t0)) * arm / dt;
        window.t.push_back(0.5 * (fit.t0 + fit.t1) - from);
        window.speed.push_back(imu.turn(fit.t0) * (R_imu_cam * fit.speed));
        window.bases.push_back(bases);
      }
      window.use.assign(window.t.size(), true);
      windows.push_back(std::move(window));
    }
    begin = std::max(end, begin + 1);
  }
  return windows;
}

}  // namespace

std::optional<InertialMotion> fitInertialMotion(const ReadoutEstimate& motion, const std::vector<StampedVector>& gyro,
                                                const std::vector<StampedVector>& accel, const Eigen::Vector3d& arm) {
  constexpr double kClear = 3.0;  // times the cost of the best that the second must have
  std::vector<Window> windows = windowsOf(motion, gyro, accel, arm);
  InertialMotion out;
  std::vector<Sums> each;
  Sums all;
  for (int round = 0; round < 3; ++round) {
    if (windows.size() < kMinWindows) return std::nullopt;
    each.clear();
    all = Sums();
    for (const Window& window : windows) all += each.emplace_back(sumsOf(window));
    double first, second;
    out.axes = best(all, &first, &second);
    out.axes_known = second > kClear * first;
    out.explained = all.vv > 0 ? 1 - first / all.vv : 0;
    if (round < 2) trim(out.axes, match(all, out.axes).k, &windows);
  }
  const std::size_t half = each.size() / 2;
  for (const bool later : {false, true}) {
    Sums part = std::accumulate(each.begin() + (later ? half : 0), later ? each.end() : each.begin() + half, Sums(),
                                [](Sums sum, const Sums& s) { return sum += s, sum; });
    double first, second;
    out.axes_known = out.axes_known && half >= kMinWindowsHalf && best(part, &first, &second) == out.axes;
  }
  const double k = match(all, out.axes).k;
  if (k <= 0) return out;
  out.scale = 1 / k;
  const Row row = rowOf(out.axes);
  double scatter = 0;
  for (const Sums& s : each) {
    const double pull = row.dot(s.b) - k * row.dot(s.G * row);
    scatter += pull * pull;
  }
  const double n = double(each.size());
  out.scale_sigma = std::sqrt(scatter * n / (n - 1)) / row.dot(all.G * row) / (k * k);
  return out;
}

}  // namespace vip_slam
