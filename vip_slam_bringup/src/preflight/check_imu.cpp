// SPDX-License-Identifier: BSD-3-Clause
// IMU gaps, units, gravity.
#include <cmath>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

double spread(const std::vector<StampedVector>& samples, std::size_t begin, std::size_t end) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = begin; i < end; ++i) mean += samples[i].value;
  mean /= double(end - begin);
  double sum = 0;
  for (std::size_t i = begin; i < end; ++i) sum += (samples[i].value - mean).squaredNorm();
  return std::sqrt(sum / double(end - begin));
}

/// The mean specific forces over the half-second windows with the least motion (about as quiet as the quietest, at most
/// a fifth of all).
std::vector<Eigen::Vector3d> quietForces(const std::vector<StampedVector>& accel, double* least_spread) {
  struct Window {
    double spread;
    Eigen::Vector3d force;
  };
  std::vector<Window> windows;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < accel.size(); ++i) {
    // A window must not span a gap.
    if (i > begin && std::abs(accel[i].t - accel[i - 1].t) > 0.1) begin = i;
    if (accel[i].t - accel[begin].t < 0.5) continue;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t k = begin; k < i; ++k) mean += accel[k].value;
    windows.push_back({spread(accel, begin, i), mean / double(i - begin)});
    begin = i;
  }
  std::sort(windows.begin(), windows.end(), [](const Window& a, const Window& b) { return a.spread < b.spread; });
  std::vector<Eigen::Vector3d> out;
  for (const Window& window : windows)
    if (window.spread <= 2 * windows.front().spread + 0.02 && out.size() <= windows.size() / 5)
      out.push_back(window.force);
  *least_spread = windows.empty() ? 0 : windows.front().spread;
  return out;
}

/// Detects an accelerometer that reports gravity instead of the specific force, which turns the world upside down and
/// has no other symptom.
void checkUpright(const std::vector<Eigen::Vector3d>& forces, const SE3& T_imu_cam, Findings* out) {
  double down = 0;  // mean component of the specific force along the image's down axis
  for (const Eigen::Vector3d& force : forces)
    down += (T_imu_cam.R().transpose() * force).normalized().y() / double(forces.size());
  if (down > 0.7)
    out->push_back({Severity::kWarning, "gravity", "the accelerometer says that the camera is held upside down",
                    "if it is not: the sign of the acceleration or T_imu_cam is wrong (lying still and level, the z "
                    "axis that points up must show +9.81)"});
}

void checkGaps(const std::string& role, const std::vector<StampedVector>& samples, Findings* out) {
  std::vector<double> steps;
  double largest = 0, at = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double step = samples[i].t - samples[i - 1].t;
    if (step > 0) steps.push_back(step);
    if (step > largest) {
      largest = step;
      at = samples[i - 1].t - samples.front().t;
    }
  }
  if (steps.empty()) return;
  const double period = upperMedian(steps);
  std::size_t gaps = 0;
  for (const double step : steps) gaps += step > std::max(3.5 * period, 0.012) ? 1 : 0;
  if (gaps > 0)
    out->push_back(
        {largest > 0.1 ? Severity::kError : Severity::kWarning, role,
         formatted("%zu gaps, the largest %.0f ms at %.1f s", gaps, 1000 * largest, at),
         "the driver or the recording loses samples; the odometry bridges short gaps with more noise and starts "
         "anew after long ones"});
  else
    out->push_back({Severity::kGood, role, formatted("no gaps, largest step %.1f ms", 1000 * largest), ""});
  if (1.0 / period < 90)
    out->push_back({Severity::kWarning, role, formatted("only %.0f Hz", 1.0 / period),
                    "100 Hz or more is wanted, 200 Hz is good"});
}

}  // namespace

Findings checkImu(const Recording& r) {
  Findings out;
  const bool united = !r.sensor.topics.imu.empty();
  checkGaps(united ? "IMU" : "gyroscope", r.gyro_samples, &out);
  if (!united) checkGaps("accelerometer", r.accel_samples, &out);
  for (const auto* samples : {&r.gyro_samples, &r.accel_samples}) {
    const std::string role = samples == &r.gyro_samples ? "gyroscope" : "accelerometer";
    if (samples->size() < 20) continue;
    std::size_t bad = 0;
    for (const auto& s : *samples) bad += s.value.allFinite() ? 0 : 1;
    if (bad > 0) {
      out.push_back({Severity::kError, role, formatted("%zu values are not numbers", bad), "the driver is broken"});
      return out;
    }
    if (spread(*samples, 0, samples->size()) < 1e-9)
      out.push_back(
          {Severity::kError, role, "the values never change",
           role == "gyroscope" ? "is this an accelerometer-only stream?" : "is this a gyroscope-only stream?"});
  }
  if (!r.gyro_samples.empty()) {
    double largest = 0;
    for (const auto& s : r.gyro_samples) largest = std::max(largest, s.value.stableNorm());
    if (largest > 40)
      out.push_back({Severity::kError, "gyroscope", formatted("rates up to %.4g", largest),
                     "degrees a second? radians a second are expected"});
  }
  if (r.gyro_range.samples() > 0)
    out.push_back({Severity::kWarning, "gyroscope",
                   formatted("%zu samples at the end of its range, %.2f rad/s", std::size_t(r.gyro_range.samples()),
                             r.gyro_range.end()),
                   "a larger range in the driver; how much faster it turned only images tell"});
  double least_spread = 0;
  const std::vector<Eigen::Vector3d> forces = quietForces(r.accel_samples, &least_spread);
  if (forces.empty()) return out;
  std::vector<double> lengths;
  for (const Eigen::Vector3d& force : forces) lengths.push_back(force.norm());
  const double g = upperMedian(lengths);
  if (g > 0.85 && g < 1.15)
    out.push_back({Severity::kError, "gravity", formatted("%.2f when quiet: the accelerometer reports in g", g),
                   "multiply by 9.81 in the driver; m/s^2 are expected"});
  else if (g < 2.0)
    out.push_back({Severity::kError, "gravity", formatted("%.2f m/s^2 when quiet: gravity has been taken out", g),
                   "publish the raw specific force, not the linear acceleration"});
  else if (std::abs(g - r.sensor.gravity) > (least_spread < 0.3 ? 0.35 : 1.2))
    out.push_back({Severity::kWarning, "gravity",
                   formatted("%.2f m/s^2 when quiet, expected %.2f", g, r.sensor.gravity),
                   "calibrate the accelerometer (scale, bias)"});
  else
    out.push_back({Severity::kGood, "gravity", formatted("%.2f m/s^2 when quiet", g), ""});
  if (g > 2.0) checkUpright(forces, r.sensor.T_imu_cam, &out);
  if (least_spread > 0.5 && r.sensor.hasGyro())
    out.push_back({Severity::kNote, "start", "the sensor is never still",
                   "a second of standing still at the start helps the initialisation"});
  return out;
}

}  // namespace vip_slam
