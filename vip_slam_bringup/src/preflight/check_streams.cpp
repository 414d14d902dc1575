// SPDX-License-Identifier: BSD-3-Clause
// Topics and rates.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_ros/stream_faults.h"

namespace vip_slam {
namespace {

struct Wanted {
  std::string role, topic;
  std::vector<std::string> types;
  const StreamRecord* stream;
  double rate;
  bool required;
};

std::vector<Wanted> wanted(const Recording& r) {
  const SensorTopics& t = r.sensor.topics;
  const auto image = [](const std::string& encoding) {
    return std::vector<std::string>{encoding == "compressed" ? "sensor_msgs/CompressedImage" : "sensor_msgs/Image"};
  };
  const std::vector<std::string> imu{"sensor_msgs/Imu"}, info{"sensor_msgs/CameraInfo"};
  std::vector<Wanted> out{
      {"colour image", t.color, image(r.sensor.color_encoding), &r.color, r.sensor.color_rate, true},
      {"depth image", t.depth, image(r.sensor.depth_encoding), &r.depth, r.sensor.depth_rate, !t.depth.empty()},
      {"colour camera_info", t.color_info, info, &r.color_info, r.sensor.color_rate,
       r.sensor.intrinsics_from_camera_info},
      {"depth camera_info", t.depth_info, info, &r.depth_info, r.sensor.depth_rate, false}};
  // The rate in the sensor file is the gyroscope's where there is one.
  out.push_back({"IMU", t.imu, imu, &r.imu, r.sensor.imu_rate, !t.imu.empty()});
  out.push_back({"gyroscope", t.gyro, imu, &r.gyro, r.sensor.imu_rate, !t.gyro.empty()});
  out.push_back({"accelerometer", t.accel, imu, &r.accel, t.gyro.empty() ? r.sensor.imu_rate : 0.0, !t.accel.empty()});
  out.erase(std::remove_if(out.begin(), out.end(), [](const Wanted& w) { return w.topic.empty() && !w.required; }),
            out.end());
  return out;
}

/// Topics of the right type that might be meant.
std::string candidates(const Recording& r, const Wanted& w) {
  std::string list;
  for (const auto& [topic, type] : r.topics) {
    if (std::find(w.types.begin(), w.types.end(), type) == w.types.end()) continue;
    list += (list.empty() ? "" : ", ") + topic;
  }
  const std::string where = r.live ? "published" : "in the bag";
  if (!list.empty()) return "of type " + w.types.front() + " " + where + ": " + list;
  const bool inertial = w.types.front() == "sensor_msgs/Imu";
  return "no topic of type " + w.types.front() + " is " + where +
         (inertial ? "; RGB-D alone works as well: set topics/imu, gyro and accel to \"\" in the sensor file" : "");
}

/// Advice on a topic of the wrong type.
std::string adviceOnType(const Recording& r, const Wanted& w, const std::string& type) {
  const std::string key = w.role == "colour image" ? "color/encoding" : "depth/encoding";
  if (w.role.find("image") != std::string::npos && type == "sensor_msgs/CompressedImage")
    return "set " + key + ": compressed in the sensor file";
  if (w.role.find("image") != std::string::npos && type == "sensor_msgs/Image")
    return "set " + key + " in the sensor file to what the driver publishes";
  return candidates(r, w);
}

/// Jitter of stamps against the true times, one sigma, s. A late stamp makes the step before it longer and the one
/// after it shorter by the same amount; a varying rate does not.
double stampJitter(const std::vector<double>& stamps, double period) {
  constexpr std::size_t kEnough = 50;
  double sum = 0;
  std::size_t pairs = 0;
  for (std::size_t i = 2; i < stamps.size(); ++i) {
    const double before = stamps[i - 1] - stamps[i - 2] - period, after = stamps[i] - stamps[i - 1] - period;
    if (std::max(std::abs(before), std::abs(after)) > 0.5 * period) continue;  // a gap, or time ran back
    sum -= before * after;
    ++pairs;
  }
  return pairs < kEnough ? 0.0 : std::sqrt(std::max(0.0, sum / static_cast<double>(pairs)));
}

/// First and last stamp.
using Span = std::pair<double, double>;

/// Of a stream whose stamps tell time; empty when there are none or all are the same, which is named by itself.
std::optional<Span> spanOf(const StreamRecord& stream) {
  if (stream.stamps.empty()) return std::nullopt;
  const auto [first, last] = std::minmax_element(stream.stamps.begin(), stream.stamps.end());
  return *first < *last ? std::optional<Span>({*first, *last}) : std::nullopt;
}

bool overlap(const Span& a, const Span& b) { return a.first <= b.second && b.first <= a.second; }

constexpr double kLate = 1.0;  // seconds that a stream may begin later, or end earlier, than the others

/// Reports streams that begin later or end earlier than the others, or have another clock: each of them alone looks
/// fine.
void checkCoverage(const Recording& r, Findings* out) {
  double begin = 1e300, end = -1e300;
  std::vector<std::pair<std::string, Span>> streams;
  for (const Wanted& w : wanted(r)) {
    const auto span = spanOf(*w.stream);
    if (!w.required || w.role.find("camera_info") != std::string::npos || !span) continue;
    streams.push_back({w.role, *span});
    begin = std::min(begin, span->first);
    end = std::max(end, span->second);
  }
  for (const auto& [role, span] : streams) {
    for (const auto& [other, other_span] : streams) {
      if (role >= other || overlap(span, other_span)) continue;
      const double apart = std::max(span.first - other_span.second, other_span.first - span.second);
      out->push_back({Severity::kError, role,
                      formatted("has no time in common with the %s, %.1f s lie between them", other.c_str(), apart),
                      "the two streams use different clocks"});
      return;
    }
  }
  if (r.live) return;  // subscriptions start one after the other
  for (const auto& [role, span] : streams) {
    const double late = span.first - begin, early = end - span.second;
    const Severity severity = std::max(late, early) > 0.1 * (end - begin) ? Severity::kError : Severity::kWarning;
    if (late > kLate)
      out->push_back({severity, role, formatted("begins %.1f s after the others", late),
                      "started late, or stamped by another clock?"});
    if (early > kLate)
      out->push_back({severity, role, formatted("ends %.1f s before the others", early),
                      "did the driver stop, or the disk fill up? or is it stamped by another clock?"});
  }
}

/// What the sensor file leaves out of an IMU, and what follows; empty text when it is whole.
Finding missingInertial(const SensorTopics& topics) {
  if (!topics.hasInertial())
    return {
        Severity::kNote, "IMU", "the sensor file names no topic: an RGB-D camera alone",
        "not checked for want of a gyroscope: the delay of the images, the readout of a rolling shutter, extrinsics, "
        "images that repeat; nothing bridges what the camera cannot see"};
  if (!topics.hasGyro())
    return {Severity::kNote, "gyroscope", "the sensor file names no topic: an accelerometer alone, for gravity",
            "not checked for want of it: the delay of the images, the readout of a rolling shutter, extrinsics, images "
            "that repeat"};
  if (!topics.hasAccel())
    return {Severity::kNote, "accelerometer", "the sensor file names no topic: a gyroscope alone",
            "not checked for want of it: gravity and its units; what is level is a guess"};
  return {};
}

}  // namespace

Findings checkTopics(const Recording& r) {
  Findings out;
  if (const Finding imu = missingInertial(r.sensor.topics); !imu.text.empty()) out.push_back(imu);
  if (r.sensor.topics.depth.empty())
    out.push_back({Severity::kNote, "depth image", "the sensor file names no topic",
                   "visual-inertial only, without planes; distances come from the IMU alone"});
  for (const Wanted& w : wanted(r)) {
    if (w.topic.empty()) {
      out.push_back({Severity::kError, w.role, "the sensor file names no topic", "fill it in; " + candidates(r, w)});
      continue;
    }
    const auto found = r.topics.find(w.topic);
    const Severity bad = w.required ? Severity::kError : Severity::kNote;
    if (found == r.topics.end()) {
      out.push_back({bad, w.role, "topic " + w.topic + " is not there", candidates(r, w)});
    } else if (std::find(w.types.begin(), w.types.end(), found->second) == w.types.end()) {
      out.push_back({bad, w.role, "topic " + w.topic + " has type " + found->second + ", expected " + w.types.front(),
                     adviceOnType(r, w, found->second)});
    } else if (w.stream->stamps.empty()) {
      out.push_back(
          {bad, w.role, "no message on " + w.topic, "is the driver running, and is this stream switched on?"});
    } else {
      out.push_back(
          {Severity::kGood, w.role, formatted("%zu messages on %s", w.stream->stamps.size(), w.topic.c_str()), ""});
      if (const std::string others = w.stream->one_frame.words(); !others.empty())
        out.push_back({Severity::kWarning, w.role, "topic " + w.topic + ": " + others, ""});
    }
  }
  return out;
}

namespace {

double medianDelay(const StreamRecord& stream) {
  std::vector<double> delays;
  for (std::size_t i = 0; i < stream.stamps.size() && i < stream.arrivals.size(); ++i)
    delays.push_back(stream.arrivals[i] - stream.stamps[i]);
  return delays.empty() ? 0 : upperMedian(delays);
}

/// A bag is read in the order of its record times: messages recorded much later than images with the same stamps come
/// too late for them.
void checkOrder(const Recording& r, Findings* out) {
  constexpr double kDepthWaits = 0.3, kImuWaits = 0.5, kImuKept = 25;  // s
  const auto images = spanOf(r.color);
  if (r.live || !images) return;
  const double color = medianDelay(r.color);
  for (const Wanted& w : wanted(r)) {
    const auto span = spanOf(*w.stream);
    // A stream of another clock has been named.
    if (w.stream == &r.color || !span || !overlap(*span, *images)) continue;
    if (w.role.find("camera_info") != std::string::npos) continue;
    const double late = medianDelay(*w.stream) - color;
    const bool depth = w.stream == &r.depth;
    if (depth ? std::abs(late) < kDepthWaits : late < kImuWaits && late > -kImuKept) continue;
    const std::string remedy = "sort the bag by header stamps";
    out->push_back({Severity::kError, w.role,
                    formatted("lies %.1f s %s in the bag than the images of the same time", std::abs(late),
                              late > 0 ? "later" : "earlier"),
                    depth || late < 0 || late > 9
                        ? remedy
                        : remedy + formatted(", or run_bag --set imu_patience=%.0f", late + 1)});
  }
}

/// Clocks that were set, whose stamps are followed, and time that began anew.
void checkClocks(const Recording& r, Findings* out) {
  if (!r.restarts.empty()) {
    const std::string more = r.restarts.size() > 1 ? formatted(", and %zu times more", r.restarts.size() - 1) : "";
    out->push_back({Severity::kError, "clock", timeRanBack(r.restarts.front()) + more,
                    "the odometry starts anew there; let all streams be stamped by a clock that goes on"});
  }
  // One finding for each clock: a driver that stamps the same time again and again sets it at every turn.
  std::map<std::optional<std::size_t>, std::vector<ClockStep>> of_clock;
  for (const ClockStep& step : r.clock_steps) of_clock[step.stream].push_back(step);
  for (const auto& [stream, steps] : of_clock) {
    const std::string topics[] = {r.sensor.topics.color, r.sensor.topics.depth, r.sensor.topics.inertial(),
                                  r.sensor.topics.accel};
    const std::string more = steps.size() > 1 ? formatted(", and was set %zu times more", steps.size() - 1) : "";
    out->push_back({Severity::kWarning, "clock", clockWasSet(steps.front(), stream ? topics[*stream] : "") + more,
                    "it is followed; let the time service slew the clock instead of setting it"});
  }
}

}  // namespace

Findings checkRates(const Recording& r) {
  Findings out;
  checkClocks(r, &out);
  for (const Wanted& w : wanted(r)) {
    const auto& stamps = w.stream->stamps;
    if (w.role.find("camera_info") != std::string::npos || stamps.empty()) continue;
    if (stamps.size() < 3) {
      out.push_back({w.required ? Severity::kError : Severity::kNote, w.role,
                     formatted("%zu messages in all", stamps.size()), "nothing can be told from so few"});
      continue;
    }
    std::size_t backward = 0, repeated = 0, lost = 0;
    double largest = 0, largest_at = 0;
    std::vector<double> steps;
    for (std::size_t i = 1; i < stamps.size(); ++i) {
      const double step = stamps[i] - stamps[i - 1];
      if (step < 0)
        ++backward;
      else if (step == 0)
        ++repeated;
      else
        steps.push_back(step);
      if (step > largest) {
        largest = step;
        largest_at = stamps[i - 1] - stamps.front();
      }
    }
    if (steps.empty()) {
      out.push_back({Severity::kError, w.role, "all stamps are the same", "the driver does not stamp its messages"});
      continue;
    }
    const double period = upperMedian(steps), rate = 1.0 / period;
    for (const double step : steps)
      if (step > 1.7 * period) lost += static_cast<std::size_t>(std::lround(step / period)) - 1;
    lost -= std::min(lost, w.stream->ahead);
    if (w.stream->ahead > 0)
      out.push_back({Severity::kWarning, w.role, stampedAhead(w.stream->ahead), "a fault of the driver's stamps"});
    if (stamps.front() < 1.0 && !r.live)
      out.push_back(
          {Severity::kWarning, w.role, "stamps begin at zero", "recorded without a clock? all streams must share one"});
    if (backward > 0)
      out.push_back({Severity::kError, w.role, formatted("time runs backwards %zu times", backward),
                     "messages come out of order, and are dropped"});
    if (repeated > 0)
      out.push_back({Severity::kWarning, w.role, formatted("%zu stamps repeat the one before", repeated),
                     "repeated messages are dropped"});
    if (w.rate > 0 && std::abs(rate - w.rate) > 0.15 * w.rate) {
      const bool far = rate < 0.5 * w.rate;
      out.push_back({far ? Severity::kError : Severity::kWarning, w.role,
                     formatted("%.1f Hz, the sensor file says %.0f Hz", rate, w.rate),
                     "set the driver's rate, or the rate in the sensor file when it is meant"});
    } else {
      out.push_back({Severity::kGood, w.role, formatted("%.1f Hz", rate), ""});
    }
    const double jitter = stampJitter(stamps, period);
    if (w.role == "colour image" && jitter > kLargeStampJitter)
      out.push_back({Severity::kWarning, w.role, formatted("stamps jitter by %.1f ms", 1e3 * jitter),
                     "stamped on arrival? let the driver take the device's own time; poses lose accuracy in turns"});
    const double share = double(lost) / (stamps.size() + lost);
    if (share > 0.005 && lost > 1)
      out.push_back({share > 0.1 ? Severity::kError : Severity::kWarning, w.role,
                     formatted("%.1f %% of the messages are missing, the largest hole is %.2f s at %.1f s", 100 * share,
                               largest, largest_at),
                     "USB bandwidth, disk or CPU too slow? lower the resolution or record compressed"});
    const double delay = medianDelay(*w.stream);
    if (r.live && std::abs(delay) > 1.0)
      out.push_back({Severity::kError, w.role,
                     formatted("stamps lie %.1f s %s the clock of this machine", std::abs(delay),
                               delay > 0 ? "behind" : "ahead of"),
                     "the driver stamps with the device's clock: set it to system or global time"});
  }
  checkOrder(r, &out);
  checkCoverage(r, &out);
  return out;
}

}  // namespace vip_slam
