// SPDX-License-Identifier: BSD-3-Clause
// Monitors the stamps of one input topic: measured rate, gaps, repetitions, backward steps, silence.
#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "vip_slam_ros/one_frame.h"

namespace vip_slam {

class StreamMonitor {
 public:
  /// `nominal_rate` in Hz; a step longer than `gap_factor` nominal periods counts as a gap. 0: rate unknown, no gaps.
  StreamMonitor(std::string topic, double nominal_rate, double gap_factor = 2.5);

  enum class Step { kGood, kGap, kRepeated, kBackward };
  /// `t`: header stamp, `arrival`: time of arrival (same clock), seconds. Thread-safe, as all of this class.
  Step add(double t, double arrival);
  void reject(const std::string& why);  ///< a message that could not be used
  /// Whether a message is of the frame that the topic began with. Else leave it out: add() it not.
  bool admits(const std::string& frame_id, double arrival);
  /// Names of the nodes that publish the topic; more than one is complained of.
  void setPublishers(std::vector<std::string> nodes);
  /// Sets the explanation of a topic without messages so far, for the text of complaint().
  void explainAbsence(const std::string& why);

  struct Report {
    std::string topic;
    std::size_t messages = 0, gaps = 0, repeated = 0, backward = 0, rejected = 0;
    std::size_t rejected_in_a_row = 0;  ///< number of newest messages that were all rejected
    std::string last_rejection;
    std::size_t of_other_frame = 0;  ///< not among `messages`
    double nominal_rate = 0;
    double rate = 0;         ///< Hz, over the last stamps
    double largest_gap = 0;  ///< seconds
    double delay = 0;        ///< arrival - stamp of the newest message, seconds
    double newest = 0;       ///< stamp, seconds
    double last_arrival = 0;
  };
  Report report() const;
  /// One sentence on why the stream cannot be used at time `now` ("topic /x: ..."); empty when it can.
  std::string fault(double now) const;
  /// The same, and also a rate that differs from the nominal one.
  std::string complaint(double now) const;
  /// Only for a stream that has stopped or no longer has usable messages: empty while good messages arrive, and before
  /// the first one.
  std::string silence(double now) const;
  /// Why there is no data of a stream: no message so far, or silence().
  std::string absence(double now) const;
  /// What is wrong with who publishes the topic; empty when one node does, with one frame_id. Part of complaint().
  std::string rivalry(double now) const;
  /// To be called after time ran backwards: the next stamp may have any value.
  void restart();

 private:
  const double gap_seconds_;
  mutable std::mutex mutex_;
  Report report_;
  std::deque<double> stamps_;
  std::optional<double> backward_;  ///< the newest stamp, when it is older than those in stamps_
  std::string absence_ = "is the name right, and the driver running?";
  bool newest_rejected_ = false;
  OneFrame frame_;
  double last_other_ = -1e300;  ///< arrival of the last message of another frame, seconds
  std::vector<std::string> publishers_;
};

}  // namespace vip_slam
