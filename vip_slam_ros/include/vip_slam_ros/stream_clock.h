// Detects that time ran backwards over several streams that are delivered in parallel, as when a bag loops.
#pragma once

#include <cstddef>
#include <vector>

namespace vip_slam {

class StreamClock {
 public:
  enum class Verdict {
    kInOrder,
    kJumpedBack,  ///< time has run back: restart
    kStray,       ///< to be left out: a single wrong stamp, or a message from before the jump that arrives late
  };

  /// `jump`: seconds by which two successive stamps must be older than the newest of their stream (a single one may be
  /// wrong). A stamp that is newer by as much than all streams must also be confirmed by the next one of its stream, so
  /// a pause of all streams costs the first message after it. An image that is delayed by a slow stereo matcher or a
  /// busy machine is older than the newest of other streams; that is not a jump.
  StreamClock(std::size_t streams, double jump);

  /// `t`: stamp in seconds.
  Verdict notice(std::size_t stream, double t);

  /// Stamp of the newest message of all streams, seconds; -1e300 before the first.
  double newest() const { return newest_; }
  /// Of one stream.
  double newest(std::size_t stream) const { return streams_.at(stream).newest; }
  /// Seconds by which the last jump went back.
  double lastJump() const { return last_jump_; }

 private:
  static constexpr double kNever = -1e300;
  struct Stream {
    double newest = kNever;
    double ahead = kNever;        ///< the last stamp, when it was far ahead and is not confirmed yet
    double before_jump = kNever;  ///< newest of all streams when time jumped
    bool suspect = false;         ///< the last stamp was far back
    int stragglers_left = 0;      ///< late messages still to be left out, until the stream has jumped too
  };

  std::vector<Stream> streams_;
  double jump_, newest_ = kNever, last_jump_ = 0;
};

}  // namespace vip_slam
