#include "vip_slam_ros/stream_clock.h"

#include <algorithm>

namespace vip_slam {
namespace {
// More than any subscriber queues between two streams; if a stream still goes on by then, its time is right after all.
constexpr int kMaxStragglers = 200;
// Two stamps that lie so close together, seconds, both far ahead, mean the same time: it has gone on meanwhile.
constexpr double kSameTime = 5.0;
}  // namespace

StreamClock::StreamClock(std::size_t streams, double jump) : streams_(streams), jump_(jump) {}

StreamClock::Verdict StreamClock::notice(std::size_t stream, double t) {
  Stream& own = streams_.at(stream);
  // Believed, a single stamp far ahead would make all that follow look like a jump back.
  const bool ahead = own.newest > kNever && own.stragglers_left == 0 && t > newest_ + jump_;
  const bool goes_on = t >= own.ahead - jump_ && t <= own.ahead + kSameTime;
  own.ahead = ahead && !goes_on ? t : kNever;
  if (own.ahead > kNever) return Verdict::kStray;
  const bool back = t < own.newest - jump_, confirmed = own.suspect;
  own.suspect = back && !confirmed;
  if (own.suspect) return Verdict::kStray;
  if (back) {
    last_jump_ = own.newest - t;
    for (Stream& s : streams_) {
      s.before_jump = newest_;
      s.stragglers_left = &s == &own ? 0 : kMaxStragglers;
      s.newest = t;
      s.suspect = false;
    }
    newest_ = t;
    return Verdict::kJumpedBack;
  }
  if (own.stragglers_left > 0) {
    // Old time ends within `jump` of where all streams were; new time begins anywhere below it.
    if (t > newest_ + jump_ && t > own.before_jump - last_jump_ / 2) {
      --own.stragglers_left;
      return Verdict::kStray;
    }
    own.stragglers_left = 0;
  }
  own.newest = std::max(own.newest, t);
  newest_ = std::max(newest_, t);
  return Verdict::kInOrder;
}

}  // namespace vip_slam
