#include "vip_slam_sim/motion/motion_generator.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>
#include <stdexcept>

#include "vip_slam_sim/rng.h"

namespace vip_slam {
namespace {

constexpr double kKnot = 0.1;   ///< s between control poses
constexpr double kFine = 0.02;  ///< s between samples of the plan
constexpr double kDeg = M_PI / 180;

/// Where the camera is and looks: forward has this yaw and pitch, roll about forward.
struct View {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double yaw = 0, pitch = 0, roll = 0;
  double liveliness = 0;  ///< 0 standing, 1 moving: scales the shake

  SE3 pose() const {
    Eigen::Matrix3d level;  // camera axes in a level body: right, down, forward
    level.col(0) = Eigen::Vector3d(0, -1, 0);
    level.col(1) = Eigen::Vector3d(0, 0, -1);
    level.col(2) = Eigen::Vector3d(1, 0, 0);
    const Eigen::Matrix3d R =
        (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(-pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
            .toRotationMatrix() *
        level;
    return SE3(R, p);
  }
};

/// A few sines with random phases: smooth, never repeating within a sequence, about unit amplitude.
class Wander {
 public:
  Wander(Rng& rng, double frequency) {
    for (double k : {0.61, 1.0, 1.57}) {
      f_.push_back(2 * M_PI * frequency * k * rng.uniform(0.9, 1.1));
      phase_.push_back(rng.uniform(0, 2 * M_PI));
    }
  }
  double operator()(double t) const {
    double s = 0;
    for (std::size_t i = 0; i < f_.size(); ++i) s += std::sin(f_[i] * t + phase_[i]);
    return s / 1.8;
  }

 private:
  std::vector<double> f_, phase_;
};

/// Adds what a walking hand or a hovering drone adds.
class Shake {
 public:
  Shake(const std::string& style, double yaw_swing, int seed)
      : style_(style),
        swing_(yaw_swing * kDeg),
        rng_(seed * 977 + 5),
        slow_yaw_(rng_, 0.12),
        slow_pitch_(rng_, 0.16),
        x_(rng_, 0.45),
        y_(rng_, 0.5),
        z_(rng_, 0.4),
        roll_(rng_, 0.5),
        jitter_yaw_(rng_, 1.1),
        jitter_pitch_(rng_, 1.3) {}

  void apply(double t, View* view) const {
    const double e = view->liveliness;
    if (style_ == "smooth" || e <= 0) return;
    view->yaw += e * swing_ * slow_yaw_(t);
    const Eigen::Vector3d left(-std::sin(view->yaw), std::cos(view->yaw), 0);
    const Eigen::Vector3d ahead(std::cos(view->yaw), std::sin(view->yaw), 0);
    if (style_ == "handheld") {
      const double step = 2 * M_PI * 1.75 * t;
      view->p += e * (left * (0.014 * std::sin(step / 2) + 0.015 * y_(t)) + ahead * 0.008 * std::sin(step + 1));
      view->p.z() += e * (0.012 * std::sin(step) + 0.02 * z_(t));
      view->pitch += e * kDeg * (3.5 * slow_pitch_(t) + 0.7 * std::sin(step + 0.6) + 0.4 * jitter_pitch_(t));
      view->roll += e * kDeg * (1.2 * std::sin(step / 2 + 0.4) + 1.5 * roll_(t));
      view->yaw += e * kDeg * (0.8 * std::sin(step / 2 + 2) + 0.5 * jitter_yaw_(t));
    } else {
      view->p += e * (left * 0.03 * y_(t) + ahead * 0.03 * x_(t));
      view->p.z() += e * 0.05 * z_(t);
      view->pitch += e * kDeg * (2.5 * slow_pitch_(t) + 0.5 * jitter_pitch_(t));
      view->roll += e * kDeg * 2.0 * roll_(t);
      view->yaw += e * kDeg * 0.6 * jitter_yaw_(t);
    }
  }

 private:
  std::string style_;
  double swing_;
  Rng rng_;
  Wander slow_yaw_, slow_pitch_, x_, y_, z_, roll_, jitter_yaw_, jitter_pitch_;
};

double smoothStep(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10 + s * (6 * s - 15));
}

SplineTrajectory splineOf(const std::function<View(double)>& plan, double duration, const SE3& T_imu_cam) {
  std::vector<SE3> control;
  const int spans = std::max(1, static_cast<int>(std::lround(duration / kKnot)));
  const SE3 T_cam_imu = T_imu_cam.inverse();
  for (int k = 0; k < spans + 5; ++k) control.push_back(plan((k - 2) * kKnot).pose() * T_cam_imu);
  return SplineTrajectory(0, kKnot, control);
}

[[noreturn]] void fail(const std::string& what) { throw std::invalid_argument(what); }

// ---- path ----

struct Leg {
  enum Kind { kMove, kTurn, kPause } kind;
  Eigen::Vector3d from, to;
  double amount;  ///< radians or seconds
};

std::vector<Leg> parseWaypoints(const MotionOptions& o) {
  std::vector<Leg> legs;
  std::stringstream all(o.waypoints);
  std::string item;
  bool started = false;
  Eigen::Vector3d here = Eigen::Vector3d::Zero();
  while (std::getline(all, item, ';')) {
    std::stringstream in(item);
    std::string word;
    in >> word;
    if (word.empty()) continue;
    if (word == "turn" || word == "pause") {
      double value;
      if (!(in >> value) || !started)
        fail("motion/waypoints: '" + item + "': expected '" + word + " NUMBER' after a point");
      if (word == "turn")
        legs.push_back({Leg::kTurn, here, here, value * kDeg});
      else
        legs.push_back({Leg::kPause, here, here, value});
      continue;
    }
    std::replace(item.begin(), item.end(), ',', ' ');
    std::stringstream numbers(item);
    Eigen::Vector3d p(0, 0, o.height);
    if (!(numbers >> p.x() >> p.y())) fail("motion/waypoints: '" + item + "': expected x,y or x,y,z");
    double z;
    if (numbers >> z) p.z() = z;
    if (started) legs.push_back({Leg::kMove, here, p, 0});
    here = p;
    started = true;
  }
  if (legs.empty()) fail("motion/waypoints: expected at least two points");
  return legs;
}

/// Triangular moving average over +-half samples (two boxes), ends held.
template <class T>
std::vector<T> smoothed(const std::vector<T>& in, int half) {
  std::vector<T> out = in;
  const int n = static_cast<int>(in.size()), r = std::max(1, half / 2);
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<T> next(out);
    for (int i = 0; i < n; ++i) {
      T sum = out[i] * 0.0;
      for (int k = -r; k <= r; ++k) sum += out[std::clamp(i + k, 0, n - 1)];
      next[i] = sum * (1.0 / (2 * r + 1));
    }
    out = next;
  }
  return out;
}

SplineTrajectory makePath(const MotionOptions& o, const SE3& T_imu_cam, int seed) {
  const std::vector<Leg> legs = parseWaypoints(o);
  std::vector<Eigen::Vector3d> p;
  std::vector<double> heading, lively;
  double yaw = o.yaw * kDeg;
  for (const Leg& leg : legs)
    if (leg.kind == Leg::kMove) {
      yaw = std::atan2(leg.to.y() - leg.from.y(), leg.to.x() - leg.from.x());
      break;
    }
  const auto stay = [&](const Eigen::Vector3d& at, double seconds, double life) {
    for (int i = 0; i < static_cast<int>(seconds / kFine); ++i)
      p.push_back(at), heading.push_back(yaw), lively.push_back(life);
  };
  stay(legs.front().from, o.hold, 0);
  for (const Leg& leg : legs) {
    if (leg.kind == Leg::kPause) {
      stay(leg.to, leg.amount, 0.15);
    } else if (leg.kind == Leg::kTurn) {
      const int n = static_cast<int>(std::abs(leg.amount) / (o.turn_rate * kDeg) / kFine) + 1;
      const double from = yaw;
      for (int i = 1; i <= n; ++i) {
        yaw = from + leg.amount * i / n;
        p.push_back(leg.to);
        heading.push_back(yaw);
        lively.push_back(0.5);
      }
    } else {
      const Eigen::Vector3d d = leg.to - leg.from;
      if (d.head<2>().norm() > 1e-6) {
        double to = std::atan2(d.y(), d.x());
        while (to - yaw > M_PI) to -= 2 * M_PI;
        while (to - yaw < -M_PI) to += 2 * M_PI;
        yaw = to;
      }
      const int n = static_cast<int>(d.norm() / o.speed / kFine) + 1;
      for (int i = 1; i <= n; ++i)
        p.push_back(leg.from + d * (double(i) / n)), heading.push_back(yaw), lively.push_back(1);
    }
  }
  stay(legs.back().to, 1.5, 0);
  // Ease in and out of every leg; look into a corner half a second before walking round it.
  const auto samples = [](double seconds) { return static_cast<int>(seconds / kFine); };
  p = smoothed(p, samples(0.8));
  lively = smoothed(lively, samples(1.2));
  const int ahead = samples(0.5);
  std::vector<double> early(heading.size());
  for (std::size_t i = 0; i < heading.size(); ++i)
    early[i] =
        i < static_cast<std::size_t>(o.hold / kFine) ? heading[i] : heading[std::min(i + ahead, heading.size() - 1)];
  heading = smoothed(early, samples(1.3));

  const Shake shake(o.style, o.yaw_swing, seed);
  const double length = (static_cast<double>(p.size()) - 1) * kFine;
  const auto plan = [&](double t) {
    const double at = t + o.start_at;
    const double f = std::clamp(at / kFine, 0.0, static_cast<double>(p.size() - 1));
    const auto i = std::min<std::size_t>(static_cast<std::size_t>(f), p.size() - 2);
    const double s = f - static_cast<double>(i);
    View v;
    v.p = p[i] * (1 - s) + p[i + 1] * s;
    v.yaw = heading[i] * (1 - s) + heading[i + 1] * s;
    v.pitch = o.pitch * kDeg;
    // Nothing moves while holding: the average above reaches into the hold.
    v.liveliness = (lively[i] * (1 - s) + lively[i + 1] * s) * smoothStep((at - o.hold) / 1.5);
    shake.apply(at, &v);
    return v;
  };
  const double duration = o.duration > 0 ? std::min(o.duration, length - o.start_at) : length - o.start_at;
  if (duration <= 0.5) fail("motion/start_at: leaves less than half a second of the path");
  return splineOf(plan, duration, T_imu_cam);
}

// ---- orbit, rotate, still ----

SplineTrajectory makeOrbit(const MotionOptions& o, const SE3& T_imu_cam, int seed) {
  Rng rng(seed * 131 + 7);
  const double a = rng.uniform(0, 2 * M_PI), b = rng.uniform(0, 2 * M_PI), c = rng.uniform(0, 2 * M_PI);
  // Several loops of unequal shape, never the same twice within a sequence.
  const auto position = [&](double s) {
    return Eigen::Vector3d(o.x + o.extent_x * (0.62 * std::sin(s + a) + 0.38 * std::sin(2.1 * s + b)),
                           o.y + o.extent_y * (0.6 * std::sin(1.27 * s + b) + 0.4 * std::sin(2.6 * s + c)),
                           o.z + o.extent_z * (0.6 * std::sin(0.83 * s + c) + 0.4 * std::sin(1.9 * s + a)));
  };
  const auto turning = [&](double s) { return 0.55 * s + 0.9 * std::sin(0.71 * s + b) + 0.35 * std::sin(1.7 * s + c); };
  double peak_p = 0, peak_yaw = 0;
  for (double s = 0; s < 60; s += 0.01) {
    peak_p = std::max(peak_p, (position(s + 5e-3) - position(s - 5e-3)).norm() / 0.01);
    peak_yaw = std::max(peak_yaw, std::abs(turning(s + 5e-3) - turning(s - 5e-3)) / 0.01);
  }
  const double rate_p = o.speed / peak_p, rate_yaw = o.max_rate / peak_yaw;
  const Shake shake(o.style, 0, seed);
  const auto plan = [&](double t) {
    const double at = t + o.start_at;
    // Phase: at rest until `hold`, then up to speed within three seconds.
    const double m = std::max(0.0, at - o.hold), ramp = 3;
    const double x = std::min(m / ramp, 1.0);
    const double phase = ramp * (x * x * x * x * (2.5 + x * (x - 3))) + std::max(0.0, m - ramp);
    View v;
    v.p = position(rate_p * phase);
    v.yaw = o.yaw * kDeg + turning(rate_yaw * phase) - turning(0);
    v.pitch = o.pitch * kDeg + 0.12 * o.max_rate * std::sin(0.9 * rate_yaw * phase);
    v.liveliness = smoothStep(m / 2);
    shake.apply(at, &v);
    return v;
  };
  return splineOf(plan, o.duration > 0 ? o.duration : 60, T_imu_cam);
}

SplineTrajectory makeRotate(const MotionOptions& o, const SE3& T_imu_cam) {
  const auto plan = [&](double t) {
    const double m = std::max(0.0, t - o.hold);
    View v;
    v.p = Eigen::Vector3d(o.x, o.y, o.z);
    // The camera turns about itself: yaw to and fro over more than a full turn, with nodding.
    const double f = o.max_rate / (1.2 * M_PI);
    v.yaw = o.yaw * kDeg + 1.2 * M_PI * (1 - std::cos(f * m));
    v.pitch = o.pitch * kDeg + 0.25 * smoothStep(m / 2) * std::sin(0.9 * m);
    v.roll = 0.1 * smoothStep(m / 2) * std::sin(0.6 * m);
    return v;
  };
  return splineOf(plan, o.duration > 0 ? o.duration : 40, T_imu_cam);
}

SplineTrajectory makeStill(const MotionOptions& o, const SE3& T_imu_cam) {
  const auto plan = [&](double) {
    View v;
    v.p = Eigen::Vector3d(o.x, o.y, o.z);
    v.yaw = o.yaw * kDeg;
    v.pitch = o.pitch * kDeg;
    return v;
  };
  return splineOf(plan, o.duration > 0 ? o.duration : 60, T_imu_cam);
}

SplineTrajectory makeFromFile(const MotionOptions& o) {
  Trajectory poses = readPoseFile(o.file);
  const SE3 place(Eigen::Quaterniond(Eigen::AngleAxisd(o.yaw * kDeg, Eigen::Vector3d::UnitZ())),
                  Eigen::Vector3d(o.x, o.y, o.z));
  const SE3 roll(Eigen::Quaterniond(Eigen::AngleAxisd(o.file_roll * kDeg, Eigen::Vector3d::UnitZ())),
                 Eigen::Vector3d::Zero());
  Trajectory chosen;
  for (StampedPose& pose : poses) {
    pose.t -= o.start_at;
    if (pose.t < 0 || (o.duration > 0 && pose.t > o.duration)) continue;
    chosen.push_back({pose.t, place * pose.T_W_B * roll});
  }
  if (chosen.size() < 2) fail("motion/file: " + o.file + ": fewer than two poses between start_at and duration");
  const double first = chosen.front().t;
  for (StampedPose& pose : chosen) pose.t -= first;
  return SplineTrajectory::fit(chosen, 0.08, 6);
}

}  // namespace

SplineTrajectory makeMotion(const MotionOptions& options, const SE3& T_imu_cam, int seed) {
  if (options.type == "path") return makePath(options, T_imu_cam, seed);
  if (options.type == "orbit") return makeOrbit(options, T_imu_cam, seed);
  if (options.type == "rotate") return makeRotate(options, T_imu_cam);
  if (options.type == "still") return makeStill(options, T_imu_cam);
  return makeFromFile(options);
}

}  // namespace vip_slam
