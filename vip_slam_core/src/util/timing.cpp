// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/util/timing.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iomanip>
#include <numeric>

#include "vip_slam_core/util/atomic_file.h"

namespace vip_slam {

double threadTimeMs() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * double(now.tv_sec) + 1e-6 * double(now.tv_nsec);
}

void TimingLog::add(const std::string& stage, double t, double elapsed_ms, double processor_ms) {
  std::lock_guard<std::mutex> lock(mutex_);
  rows_[stage].push_back({t, elapsed_ms, processor_ms});
}

TimingSummary TimingLog::summary(const std::string& stage, Clock clock) const {
  std::vector<double> ms;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto found = rows_.find(stage);
    if (found == rows_.end()) return {};
    for (const Row& row : found->second) ms.push_back(clock == Clock::kElapsed ? row.ms : row.cpu_ms);
  }
  std::sort(ms.begin(), ms.end());
  TimingSummary summary;
  summary.count = ms.size();
  summary.mean = std::accumulate(ms.begin(), ms.end(), 0.0) / double(ms.size());
  const std::size_t half = ms.size() / 2;
  summary.median = ms.size() % 2 == 1 ? ms[half] : 0.5 * (ms[half - 1] + ms[half]);
  // Nearest rank: the smallest value that 99 % do not exceed.
  summary.p99 = ms[static_cast<std::size_t>(std::ceil(0.99 * double(ms.size()))) - 1];
  summary.max = ms.back();
  return summary;
}

void TimingLog::writeCsv(const std::string& path) const {
  AtomicFile file(path);
  file.stream() << "stage,t,ms,cpu_ms\n" << std::fixed;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [stage, rows] : rows_) {
      for (const Row& row : rows) {
        file.stream() << stage << ',' << std::setprecision(9) << row.t << ',' << std::setprecision(4) << row.ms << ','
                      << row.cpu_ms << '\n';
      }
    }
  }
  file.commit();
}

}  // namespace vip_slam
