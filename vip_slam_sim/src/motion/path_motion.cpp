// SPDX-License-Identifier: BSD-3-Clause
// Walking and flying motions along waypoints.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "view_plan.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kFine = 0.02;     ///< s between samples of the plan
constexpr double kShortest = 0.5;  ///< s, of a motion

[[noreturn]] void fail(const std::string& what) { throw std::invalid_argument(what); }

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
        legs.push_back({Leg::kTurn, here, here, value * kDegree});
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

}  // namespace

SplineTrajectory makePath(const MotionOptions& o, const SE3& T_imu_cam, int seed) {
  const std::vector<Leg> legs = parseWaypoints(o);
  std::vector<Eigen::Vector3d> p;
  std::vector<double> heading, lively;
  double yaw = o.yaw * kDegree;
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
      const int n = static_cast<int>(std::abs(leg.amount) / (o.turn_rate * kDegree) / kFine) + 1;
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
  // Start and end every leg smoothly; turn the view into a corner half a second before walking round it.
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
    v.pitch = o.pitch * kDegree;
    // No shake during the hold, into which the moving average above leaks; it fades in over 1.5 s afterwards.
    v.liveliness = (lively[i] * (1 - s) + lively[i + 1] * s) * smoothStep((at - o.hold) / 1.5);
    shake.apply(at, &v);
    return v;
  };
  const double duration = o.duration > 0 ? std::min(o.duration, length - o.start_at) : length - o.start_at;
  if (duration <= kShortest)
    fail(formatted("motion/start_at: %g leaves %.2f s of the path, which takes %.2f s, expected more than %g s",
                   o.start_at, duration, length, kShortest));
  return splineOf(plan, duration, T_imu_cam);
}

}  // namespace vip_slam
