// Tells when time ran backwards over several streams that are delivered side by side, as when a bag loops.
#pragma once

#include <cstddef>
#include <vector>

namespace vip_slam {

class StreamClock {
 public:
  enum class Verdict {
    kInOrder,
    kJumpedBack,  ///< time has run back: start anew
    kStray,       ///< to be left out: a single wrong stamp, or of another stream, from before the jump, delivered late
  };

  /// `jump`: seconds by which stamps have to be older than the newest of their stream, two in a row: one may be wrong.
  /// One that is newer by so much than all streams has to be followed by another of its stream as well: a pause of all
  /// streams costs the first message after it.
  /// An image that comes late, from a slow matcher or a busy machine, is older than other streams' newest; that is not
  /// a jump.
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
    double ahead = kNever;        ///< the last stamp, when it was far ahead and nothing has followed it yet
    double before_jump = kNever;  ///< newest of all streams when time jumped
    bool suspect = false;         ///< the last stamp was far back
    int stragglers_left = 0;      ///< until the stream has jumped too, or this many were left out
  };

  std::vector<Stream> streams_;
  double jump_, newest_ = kNever, last_jump_ = 0;
};

}  // namespace vip_slam
