// One line that shows how far a long job is; plain lines now and then when the output is not a terminal.
#pragma once

#include <chrono>
#include <string>

namespace vip_slam {

class ProgressBar {
 public:
  ProgressBar(std::string label, int total);
  void update(int done);
  /// Ends the line with the overall rate.
  void finish();
  double perSecond() const;

 private:
  void print(bool last);
  std::string label_;
  int total_, done_ = 0;
  bool terminal_;
  std::chrono::steady_clock::time_point start_, shown_;
};

}  // namespace vip_slam
