// SPDX-License-Identifier: BSD-3-Clause
// Stage timing: scoped timers feed a TimingLog, which writes CSV and summarises. Milliseconds, by the clock and of the
// processor: the first is what a user waits for, the second does not depend on what else the machine runs.
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

/// Processor time that the calling thread has used, ms; work that it hands to other threads is not in it.
double threadTimeMs();

/// Thread-safe. `stage` names are free ("frontend.match"); `t` is the header stamp the work belongs to.
class TimingLog {
 public:
  enum class Clock { kElapsed, kProcessor };

  void add(const std::string& stage, double t, double elapsed_ms, double processor_ms);
  TimingSummary summary(const std::string& stage, Clock clock = Clock::kElapsed) const;
  /// Columns stage,t,ms,cpu_ms. Throws std::runtime_error naming the path when it cannot be written.
  void writeCsv(const std::string& path) const;

 private:
  struct Row {
    double t, ms, cpu_ms;
  };
  mutable std::mutex mutex_;
  std::map<std::string, std::vector<Row>> rows_;
};

/// Adds the time of its scope to `log` (which may be null: then it costs two clock reads). To be destroyed by the
/// thread that made it.
class ScopedTimer {
 public:
  ScopedTimer(TimingLog* log, std::string stage, double t)
      : log_(log),
        stage_(std::move(stage)),
        t_(t),
        start_cpu_(log ? threadTimeMs() : 0),
        start_(std::chrono::steady_clock::now()) {}
  ~ScopedTimer() {
    if (!log_) return;
    const double elapsed = milliseconds();
    log_->add(stage_, t_, elapsed, threadTimeMs() - start_cpu_);
  }
  ScopedTimer(const ScopedTimer&) = delete;
  ScopedTimer& operator=(const ScopedTimer&) = delete;
  double milliseconds() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  TimingLog* log_;
  std::string stage_;
  double t_, start_cpu_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace vip_slam
