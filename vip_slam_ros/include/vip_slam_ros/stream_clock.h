// Detects that time ran backwards over several streams that are delivered in parallel, as when a bag loops.
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

namespace vip_slam {

class StreamClock {
 public:
  enum class Verdict {
    kInOrder,
    kJumpedBack,  ///< time has run back: restart
    kSetBack,     ///< in order, and shows that the clock of all streams was set back by less than `jump`
    kStray,       ///< to be left out: a single wrong stamp, or a message from before the jump that arrives late
  };

  /// `jump`: seconds by which two successive stamps must be older than the newest of their stream (a single one may be
  /// wrong). A stamp that is newer by as much than all streams must also be confirmed by the next one of its stream, so
  /// a pause of all streams costs the first message after it. An image that is delayed by a slow stereo matcher or a
  /// busy machine is older than the newest of other streams; that is not a jump.
  /// A smaller step back that all running streams make together, by the same amount, is a clock that was set (NTP). One
  /// stream alone may have a wrong stamp, a clock of its own or a late message. What repeats a stamp is refused by
  /// those who take the messages, and the odometry goes on from the last pose.
  StreamClock(std::size_t streams, double jump);

  /// `t`: stamp in seconds.
  Verdict notice(std::size_t stream, double t);

  /// Stamp of the newest message of all streams, seconds; -1e300 before the first.
  double newest() const { return newest_; }
  /// Of one stream.
  double newest(std::size_t stream) const { return streams_.at(stream).newest; }
  /// Seconds by which the last jump or step of all streams went back.
  double lastJump() const { return last_jump_; }

 private:
  static constexpr double kNever = -1e300;
  struct Stream {
    double newest = kNever;
    double ahead = kNever;        ///< the last stamp, when it was far ahead and is not confirmed yet
    double before_jump = kNever;  ///< newest of all streams when time jumped
    bool suspect = false;         ///< the last stamp was far back
    int stragglers_left = 0;      ///< late messages still to be left out, until the stream has jumped too
    /// Stamps of the last message, which after a step back is not the newest, and of the one before it.
    double last = kNever, before_last = kNever;
    std::deque<double> intervals;  ///< between the last messages in order, seconds
    double step = 0;               ///< seconds by which the stream last stepped back; 0: it did not
    double stepped_at = kNever;    ///< the first stamp after that step
    bool backward = false;         ///< that stamp was older than the newest, not only early
  };

  /// Notes a step back of the stream.
  void followStep(Stream* own, double t) const;
  /// Whether all streams that run have just stepped back by the same time.
  bool steppedTogether(double t) const;

  std::vector<Stream> streams_;
  double jump_, newest_ = kNever, last_jump_ = 0;
};

}  // namespace vip_slam
