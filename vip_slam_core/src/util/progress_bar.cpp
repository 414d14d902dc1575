// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/util/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace vip_slam {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

}  // namespace

ProgressBar::ProgressBar(std::string title)
    : title_(std::move(title)), terminal_(isatty(STDERR_FILENO) != 0), begin_(Clock::now()), drawn_(begin_) {}

void ProgressBar::update(double fraction, const std::string& note) {
  fraction = fraction > 0 ? std::min(fraction, 1.0) : 0.0;  // 0 of 0 is no number
  const int tenths = int(fraction * 10);
  if (terminal_ ? since(drawn_) < 0.1 : tenths == tenths_) return;
  drawn_ = Clock::now();
  tenths_ = tenths;
  const double elapsed = since(begin_);
  const double left = fraction > 0.01 ? elapsed * (1 - fraction) / fraction : 0;
  if (terminal_) {
    const int width = 30, full = int(fraction * width);
    std::fprintf(stderr, "\r%s [%s%s] %3.0f%%  %.0f s left  %s\x1b[K", title_.c_str(), std::string(full, '#').c_str(),
                 std::string(width - full, '.').c_str(), 100 * fraction, left, note.c_str());
  } else {
    std::fprintf(stderr, "%s %3d%%  %.0f s, %.0f s left  %s\n", title_.c_str(), 10 * tenths, elapsed, left,
                 note.c_str());
  }
  std::fflush(stderr);
}

void ProgressBar::finish(const std::string& note) {
  std::fprintf(stderr, "%s%s: %s%s\n", terminal_ ? "\r" : "", title_.c_str(), note.c_str(), terminal_ ? "\x1b[K" : "");
}

}  // namespace vip_slam
