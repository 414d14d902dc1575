// SPDX-License-Identifier: BSD-3-Clause
// The least delay of a stream's messages: what their arrival tells about the clock of their stamps. ROS-free.
#pragma once

#include <deque>
#include <optional>

namespace vip_slam {

class LeastDelay {
 public:
  /// `stamp`, s, of a message and when it arrived, s, on any other clock; in the order of arrival.
  void add(double stamp, double arrival);
  void clear();

  /// Seconds by which `stamp` is later than the least delay lets it be, which no delay makes; negative: as by a longer
  /// delay. Empty: arrival does not tell (too few messages, another rate, a busy machine).
  std::optional<double> excess(double stamp, double arrival) const;

 private:
  /// Largest stamp - arrival of each second: that of the message with the least delay. Newest last.
  std::deque<double> ahead_;
  double second_ = 0;  ///< arrival at which the newest of them began
};

}  // namespace vip_slam
