// SPDX-License-Identifier: BSD-3-Clause
// The clock of the machine against time that goes on while it is set: which stamp belongs to a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace vip_slam {

class MachineClock {
 public:
  /// From time `from` on, s, stamps are later by `seconds` than before. Where that undoes steps before it, the clock
  /// was wrong in between: none of them counts, and stamps of those times are as if it had not been set.
  void set(double from, double seconds) {
    constexpr double kUndone = 0.05;  // s
    sets_.push_back({from, seconds});
    double sum = 0;
    for (auto set = sets_.end(); set != sets_.begin();) {
      sum += (--set)->seconds;
      if (std::abs(sum) < kUndone && sets_.end() - set > 1) {
        sets_.erase(set, sets_.end());
        return;
      }
    }
  }

  /// Of time `t`, s.
  double stamp(double t) const {
    return std::accumulate(sets_.begin(), sets_.end(), t,
                           [t](double sum, const Set& set) { return t >= set.from ? sum + set.seconds : sum; });
  }

 private:
  struct Set {
    double from, seconds;
  };
  std::vector<Set> sets_;
};

}  // namespace vip_slam
