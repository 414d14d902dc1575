#include "vip_slam_ros/stream_clock.h"

#include <algorithm>

namespace vip_slam {
namespace {
// Largest number of late messages per stream, more than any subscriber queue holds; beyond, the stream's time is taken
// to be right.
constexpr int kMaxStragglers = 200;
// Two stamps far ahead that are within this time of each other, seconds, confirm each other: time has really advanced.
constexpr double kSameTime = 5.0;
}  // namespace

StreamClock::StreamClock(std::size_t streams, double jump) : streams_(streams), jump_(jump) {}

StreamClock::Verdict StreamClock::notice(std::size_t stream, double t) {
  Stream& own = streams_.at(stream);
  // A single wrong stamp far ahead, if accepted, would make all following ones look like a jump back.
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
    // Stamps from before the jump are near where all streams were then; those after it are clearly below.
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
