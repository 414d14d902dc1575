// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/stream_monitor.h"

#include <algorithm>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr std::size_t kWindow = 100;  // stamps over which the rate is measured
constexpr double kSilent = 2.0;       // seconds without a message
constexpr std::size_t kUnusable = 5;  // messages in a row that could not be used

}  // namespace

StreamMonitor::StreamMonitor(std::string topic, double nominal_rate, double gap_factor)
    : gap_seconds_(nominal_rate > 0 ? gap_factor / nominal_rate : 0) {
  report_.topic = std::move(topic);
  report_.nominal_rate = nominal_rate;
}

StreamMonitor::Step StreamMonitor::add(double t, double arrival) {
  std::lock_guard<std::mutex> lock(mutex_);
  ++report_.messages;
  if (!newest_rejected_) report_.rejected_in_a_row = 0;
  newest_rejected_ = false;
  report_.delay = arrival - t;
  report_.last_arrival = arrival;
  Step step = Step::kGood;
  if (!stamps_.empty()) {
    const double dt = t - stamps_.back();
    if (dt == 0) {
      ++report_.repeated;
      return Step::kRepeated;
    }
    if (dt < 0) {
      ++report_.backward;
      // Two successive stamps in order: the wrong one was the stamp before them.
      const bool again = backward_ && t > *backward_;
      backward_ = t;
      if (!again) return Step::kBackward;
      stamps_.clear();
      step = Step::kBackward;
    }
    if (gap_seconds_ > 0 && dt > gap_seconds_) {
      ++report_.gaps;
      report_.largest_gap = std::max(report_.largest_gap, dt);
      step = Step::kGap;
    }
  }
  backward_.reset();
  report_.newest = t;
  stamps_.push_back(t);
  if (stamps_.size() > kWindow) stamps_.pop_front();
  return step;
}

void StreamMonitor::reject(const std::string& why) {
  std::lock_guard<std::mutex> lock(mutex_);
  ++report_.rejected;
  ++report_.rejected_in_a_row;
  newest_rejected_ = true;
  report_.last_rejection = why;
}

bool StreamMonitor::admits(const std::string& frame_id, double arrival) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (frame_.admits(frame_id)) return true;
  last_other_ = arrival;
  return false;
}

void StreamMonitor::setPublishers(std::vector<std::string> nodes) {
  std::lock_guard<std::mutex> lock(mutex_);
  publishers_ = std::move(nodes);
}

std::string StreamMonitor::rivalry(double now) const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::string words;
  if (now - last_other_ <= kSilent) words = frame_.words();
  if (publishers_.size() > 1) {
    std::string names;
    for (const std::string& node : publishers_) names += (names.empty() ? "" : ", ") + node;
    words += (words.empty() ? "" : "; ") + ("published by " + std::to_string(publishers_.size()) + " nodes: " + names);
  }
  return words;
}

void StreamMonitor::explainAbsence(const std::string& why) {
  std::lock_guard<std::mutex> lock(mutex_);
  absence_ = why;
}

StreamMonitor::Report StreamMonitor::report() const {
  std::lock_guard<std::mutex> lock(mutex_);
  Report report = report_;
  report.of_other_frame = frame_.leftOut();
  if (stamps_.size() > 1 && stamps_.back() > stamps_.front()) {
    report.rate = double(stamps_.size() - 1) / (stamps_.back() - stamps_.front());
  }
  return report;
}

std::string StreamMonitor::silence(double now) const {
  const Report r = report();
  const double seconds = now - r.last_arrival;
  if (r.rejected_in_a_row >= kUnusable && seconds <= kSilent) return "topic " + r.topic + ": " + r.last_rejection;
  if (r.messages == 0 || seconds <= kSilent) return "";
  const std::string others = rivalry(now);
  return "topic " + r.topic + ": " + formatted("silent for %.1f s", seconds) + (others.empty() ? "" : "; " + others);
}

std::string StreamMonitor::absence(double now) const {
  const Report r = report();
  if (r.messages > 0 || r.rejected > 0) return silence(now);
  std::lock_guard<std::mutex> lock(mutex_);
  return "topic " + r.topic + ": no message so far; " + absence_;
}

std::string StreamMonitor::fault(double now) const {
  const Report r = report();
  const std::string topic = "topic " + r.topic + ": ";
  if (r.rejected > 0 && r.messages <= r.rejected) return topic + r.last_rejection;
  if (const std::string absent = absence(now); !absent.empty()) return absent;
  if (r.messages >= kWindow && r.repeated + 1 == r.messages)
    return topic + "all stamps are the same: the driver does not stamp its messages";
  return "";
}

std::string StreamMonitor::complaint(double now) const {
  const std::string fault_now = fault(now);
  if (!fault_now.empty()) return fault_now;
  const Report r = report();
  if (const std::string others = rivalry(now); !others.empty()) return "topic " + r.topic + ": " + others;
  if (r.nominal_rate > 0 && r.rate > 0 && r.rate < 0.7 * r.nominal_rate) {
    return "topic " + r.topic + ": " + formatted("%.1f Hz, the sensor configuration says %.1f", r.rate, r.nominal_rate);
  }
  return "";
}

void StreamMonitor::restart() {
  std::lock_guard<std::mutex> lock(mutex_);
  stamps_.clear();
  backward_.reset();
}

}  // namespace vip_slam
