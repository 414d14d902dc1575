// SPDX-License-Identifier: BSD-3-Clause
// All of time of streams that are delivered in parallel: the stamp that each message gets, on one clock that goes on,
// and what is left out. ROS-free, single owner; the nodelet and the offline runner call take() and nothing else.
//
// A message whose stamp does not follow the one before waits for the next ones, which tell what it is:
// - a single stamp ahead: the next of its stream lies before it, or arrives as on the clock of before; it is left out.
// - a gap: the next of its stream goes on from there.
// - a clock of one device that was set: its messages go on from there while the other streams go on as before, and
//   their arrival shows that no delay did it. The stream is followed on the clock that it began with.
// - the machine's clock that was set (NTP): all running streams step by the same. Time goes on from before.
// - time that began anew (a bag that loops): two stamps are older than the newest of their stream by more than `jump`.
// A message that is late or comes twice is none of these. It is handed on, and refused by those who take it.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "vip_slam_ros/stream_time/least_delay.h"

namespace vip_slam {

/// A clock that was set while messages came.
struct ClockStep {
  std::optional<std::size_t> stream;  ///< whose clock; empty: that of all
  double t = 0;                       ///< first stamp after it, s, as given
  double time = 0;                    ///< its time on the clock that goes on, s
  double seconds = 0;                 ///< by which stamps are later than before; negative: set back
};

class StreamTime {
 public:
  struct Listener {
    std::function<void(const ClockStep&)> stepped;
    /// Time began anew, with stamps so many seconds earlier than if it had gone on: what comes now is not related to
    /// what came before.
    std::function<void(double seconds)> restarted;
  };
  struct LeftOut {
    std::size_t ahead = 0;  ///< stamped later than the next message of their stream
    std::size_t stray = 0;  ///< from before a restart, arrived after it
  };
  /// Gets the message's time, s.
  using Deliver = std::function<void(double t)>;

  /// `jump`: see above, s. An image that is delayed by a slow stereo matcher or a busy machine is older than the newest
  /// of other streams; that is no jump.
  StreamTime(std::size_t streams, double jump, Listener listener);

  /// Takes a message with its stamp and when it arrived, s; the latter on a clock of its own or, when that is not
  /// there, on any. `deliver` is called at once, or by a later take() or end(), in order within the stream, or never.
  void take(std::size_t stream, double stamp, double arrival, Deliver deliver);
  /// No more messages come: those that wait are delivered.
  void end();

  /// Of the newest message delivered, s; -1e300 before the first.
  double newest() const { return newest_; }
  double newest(std::size_t stream) const { return streams_.at(stream).newest; }
  /// The stamp of time `t` on the machine's clock as it is set now.
  double onMachineClock(double t) const { return t - machine_shift_; }
  const LeftOut& leftOut(std::size_t stream) const { return streams_.at(stream).left_out; }

 private:
  static constexpr double kNever = -1e300;
  static constexpr double kRunning = 1.0;  ///< s without a message after which a stream is not asked, and none waits
  struct Message {
    double stamp, arrival;
    std::size_t number;  ///< in the order of take()
    Deliver deliver;
  };
  /// What the messages that wait may be, besides single wrong stamps.
  enum class Wait { kGap, kStep };
  struct Stream {
    double shift = 0;                       ///< added to stamps, besides that of all
    double last = kNever, newest = kNever;  ///< time of the last message delivered, and of the newest
    std::deque<double> intervals;           ///< between the last messages in order, s
    LeastDelay delay;
    std::size_t delivered = 0;
    LeftOut left_out;

    std::vector<Message> held;
    Wait wait = Wait::kGap;
    bool forward = false, by_arrival = false;
    std::vector<std::size_t> delivered_then;  ///< by each stream when the first of those held came

    double before_restart = kNever;  ///< newest of all streams then
    int stragglers_left = 0;         ///< late messages still to be left out, until the stream has restarted too
  };

  double time(const Stream& own, const Message& message) const { return message.stamp + own.shift + machine_shift_; }
  /// Adds a message whose stamp is no straggler's: passes it on, or lets it wait.
  void admit(Stream* own, Message message);
  /// Whether a message has to wait for the next ones; sets what for.
  bool waits(Stream* own, const Message& message) const;
  /// Whether a message follows those before the ones that wait, so that their stamps were wrong.
  bool goesOnAsBefore(const Stream& own, const Message& message) const;
  /// `follows`: what comes next is to follow this message.
  void pass(Stream* own, const Message& message, bool follows = true);
  void release(Stream* own, bool follow = true);

  /// Decides what waits, where that can be told by now.
  void settle();
  bool settleTogether();
  void settleAlone(Stream* own);
  /// Seconds by which a waiting stream has stepped.
  double stepOf(const Stream& own) const;
  bool confirmed(const Stream& own) const;
  bool running(const Stream& own) const { return own.last > kNever && own.newest >= newest_ - kRunning; }
  /// Whether another stream has gone on without a step since.
  bool othersGoOn(const Stream& own) const;
  /// Whether messages come sooner, and no stream's stamp has run back.
  bool becameFaster(const Stream& own) const;
  bool farBack(const Stream& own) const;

  /// A message from before a restart that arrives after it, with time `t`.
  bool straggles(Stream* own, double t);
  void restart(Stream* own);
  /// All that wait, in the order in which they came; none waits then.
  std::vector<std::pair<Stream*, Message>> takeHeld();

  std::vector<Stream> streams_;
  double jump_;
  Listener listener_;
  double machine_shift_ = 0;  ///< added to the stamps of all
  double newest_ = kNever;
  double restarted_by_ = 0;  ///< s
  std::size_t taken_ = 0;
};

}  // namespace vip_slam
