#include "vip_slam_ros/stream_clock.h"

#include <algorithm>

namespace vip_slam {
namespace {
// More than any subscriber queues between two streams; if a stream still goes on by then, its time is right after all.
constexpr int kMaxStragglers = 200;
}  // namespace

StreamClock::StreamClock(std::size_t streams, double jump) : streams_(streams), jump_(jump) {}

StreamClock::Verdict StreamClock::notice(std::size_t stream, double t) {
  Stream& own = streams_.at(stream);
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
