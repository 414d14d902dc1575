// Which stamps enter a trajectory where the clock runs back: a bag that loops, recordings that were joined, a device
// that began to count anew. A trajectory has each time once, so that of times that come again the first pass counts.
#pragma once

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace vip_slam {

class TimePasses {
 public:
  /// The next stamp, s: whether it belongs into the trajectory.
  bool take(double t) {
    if (t == newest_) return false;
    if (t < newest_) {
      if (begin_ <= end_) passes_.emplace_back(begin_, end_);
      begin_ = kNever;
      end_ = -kNever;
    }
    newest_ = t;
    const bool covered = std::any_of(passes_.begin(), passes_.end(),
                                     [t](const auto& pass) { return pass.first <= t && t <= pass.second; });
    if (covered) return false;
    begin_ = std::min(begin_, t);
    end_ = t;
    return true;
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<std::pair<double, double>> passes_;  ///< first and last stamp taken of each pass that is over
  double newest_ = -kNever;                        ///< of the pass under way
  double begin_ = kNever, end_ = -kNever;          ///< of what was taken of it
};

}  // namespace vip_slam
