// A device whose clock is set while the others' go on: its stamps step, the arrival of its messages does not. ROS-free,
// single owner; used by the nodelet and the offline runner before StreamClock.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace vip_slam {

class ClockSteps {
 public:
  /// Of one stream alone, or of several of one device.
  struct Step {
    std::size_t stream = 0;
    double t = 0;        ///< first stamp after it, s, as given
    double seconds = 0;  ///< by which stamps are later than before; negative: set back
  };

  /// `longest`: larger steps (s) are a restart, and left to StreamClock.
  ClockSteps(std::size_t streams, double longest);

  /// The stamp of a message on the clock that its stream began with, s. Empty: it shows a step that the next messages
  /// have to confirm, and is to be left out. A step that all streams make is one of the machine's clock, and passed on.
  /// `arrival`: when the message was received, s, on a clock of its own.
  std::optional<double> follow(std::size_t stream, double t, double arrival);

  /// Time ran back: what was known of the clocks holds no longer.
  void restart() { streams_.assign(streams_.size(), Stream()); }

  const std::vector<Step>& steps() const { return steps_; }

 private:
  struct Stream {
    double shift = 0;                   ///< added to stamps
    double last = 0, arrived = -1e300;  ///< of the last message that was passed on; its stamp with the shift
    std::deque<double> intervals;
    /// Largest stamp - arrival of each second: that of the message with the least delay. Newest last.
    std::deque<double> ahead;
    double second = 0;  ///< arrival at which the newest of them began
    // A step that waits to be confirmed.
    int pending = 0;
    double first = 0, first_arrival = 0, best = 0, given = 0;
  };

  void pass(Stream* own, double t, double arrival);
  /// Takes the delay of the last message, which `t` follows.
  void learn(Stream* own, double t) const;
  static double leastDelay(const Stream& own);  ///< stamp - arrival, s
  /// Whether this message shows a step against what the stream knows of its clock.
  bool begins(const Stream& own, double t, double arrival) const;
  /// Whether every other stream that runs has gone on without a step since; empty: they have not been heard of yet.
  std::optional<bool> alone(const Stream& own, double arrival) const;

  std::vector<Stream> streams_;
  double longest_;
  std::vector<Step> steps_;
};

/// In words; `topic`: of the stream.
std::string clockStepped(const ClockSteps::Step& step, const std::string& topic);

}  // namespace vip_slam
