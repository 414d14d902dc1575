// SPDX-License-Identifier: BSD-3-Clause
// Progress with the remaining time: a bar that is redrawn on a terminal, elsewhere a line per tenth.
#pragma once

#include <chrono>
#include <string>

namespace vip_slam {

class ProgressBar {
 public:
  explicit ProgressBar(std::string title);
  /// `fraction` in [0, 1]; `note` is shown behind the bar.
  void update(double fraction, const std::string& note = "");
  /// Ends the line.
  void finish(const std::string& note);

 private:
  std::string title_;
  bool terminal_;
  std::chrono::steady_clock::time_point begin_, drawn_;
  int tenths_ = -1;
};

}  // namespace vip_slam
