// Stage timing: scoped timers feed a TimingLog, which writes CSV and summarises. Wall clock, milliseconds.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace vip_slam {

struct TimingSummary {
  std::size_t count = 0;
  double mean = 0, median = 0, p99 = 0, max = 0;  ///< ms
};

/// Thread-safe. `stage` names are free ("frontend.match"); `t` is the header stamp the work belongs to.
class TimingLog {
 public:
  void add(const std::string& stage, double t, double milliseconds);
  TimingSummary summary(const std::string& stage) const;
  /// Columns stage,t,ms. Throws std::runtime_error naming the path when it cannot be written.
  void writeCsv(const std::string& path) const;

 private:
  struct Row {
    double t, ms;
  };
  mutable std::mutex mutex_;
  std::map<std::string, std::vector<Row>> rows_;
};

/// Adds the time of its scope to `log` (which may be null: then it costs two clock reads).
class ScopedTimer {
 public:
  ScopedTimer(TimingLog* log, std::string stage, double t)
      : log_(log), stage_(std::move(stage)), t_(t), start_(std::chrono::steady_clock::now()) {}
  ~ScopedTimer() {
    if (log_) log_->add(stage_, t_, milliseconds());
  }
  ScopedTimer(const ScopedTimer&) = delete;
  ScopedTimer& operator=(const ScopedTimer&) = delete;
  double milliseconds() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  TimingLog* log_;
  std::string stage_;
  double t_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace vip_slam
