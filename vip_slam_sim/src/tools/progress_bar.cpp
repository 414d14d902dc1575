#include "progress_bar.h"

#include <unistd.h>

#include <cstdio>

namespace vip_slam {

ProgressBar::ProgressBar(std::string label, int total)
    : label_(std::move(label)),
      total_(total),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()),
      shown_(start_) {}

double ProgressBar::perSecond() const {
  const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  return s > 0 ? done_ / s : 0;
}

void ProgressBar::update(int done) {
  done_ = done;
  const auto now = std::chrono::steady_clock::now();
  if (now - shown_ < std::chrono::milliseconds(terminal_ ? 200 : 10000)) return;
  shown_ = now;
  print(false);
}

void ProgressBar::finish() { print(true); }

void ProgressBar::print(bool last) {
  const int width = 32, filled = total_ > 0 ? width * done_ / total_ : width;
  const double rate = perSecond();
  const double left = rate > 0 ? (total_ - done_) / rate : 0;
  std::string bar(static_cast<std::size_t>(filled), '#');
  bar.resize(width, '.');
  std::fprintf(stderr, "%s%s [%s] %d/%d  %.1f/s  %s%.0f s%s", terminal_ ? "\r" : "", label_.c_str(), bar.c_str(), done_,
               total_, rate, last ? "took " : "left ", last && rate > 0 ? done_ / rate : left,
               terminal_ && !last ? "   " : "\n");
  std::fflush(stderr);
}

}  // namespace vip_slam
