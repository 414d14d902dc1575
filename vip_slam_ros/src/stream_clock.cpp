#include "vip_slam_ros/stream_clock.h"

#include <algorithm>
#include <cmath>

#include "usual_interval.h"

namespace vip_slam {
namespace {
// Largest number of late messages per stream, more than any subscriber queue holds; beyond, the stream's time is taken
// to be right.
constexpr int kMaxStragglers = 200;
// Two stamps far ahead that are within this time of each other, seconds, confirm each other: time has really advanced.
constexpr double kSameTime = 5.0;
constexpr std::size_t kIntervals = 9, kEnough = 5;  // intervals remembered, and needed to know the usual one
constexpr double kSmallestStep = 0.02;              // seconds; beyond what stamps jitter
constexpr double kLeastOfInterval = 0.5;            // a step back is at least this part of the usual interval
constexpr double kTogether = 0.5;                   // seconds between the streams' steps: slow streams, late messages
constexpr double kRunning = 1.0;                    // a stream silent for longer than this, seconds, is not asked
// Steps agree within this part of the longer interval (a message may be lost in the step), and kJitter seconds.
constexpr double kAgree = 1.1, kJitter = 0.01;
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
      s.last = s.before_last = kNever;
      s.step = 0;
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
  followStep(&own, t);
  own.before_last = own.last;
  own.last = t;
  const bool set_back = own.step > 0 && steppedTogether(t);
  if (set_back) {
    last_jump_ = own.step;
    for (Stream& s : streams_) s.step = 0;
  }
  own.newest = std::max(own.newest, t);
  newest_ = std::max(newest_, t);
  return set_back ? Verdict::kSetBack : Verdict::kInOrder;
}

void StreamClock::followStep(Stream* own, double t) const {
  if (own->before_last > kNever && own->intervals.size() >= kEnough) {
    // After a single stamp that was ahead the next one lies back of it, but not of the one before.
    const double interval = usualInterval(own->intervals);
    const double back = std::min(own->last + interval, own->before_last + 2 * interval) - t;
    if (back > std::max(kSmallestStep, kLeastOfInterval * interval)) {
      own->step = back;
      own->backward = t < own->newest;
      own->stepped_at = t;
    }
  }
  if (own->step > 0 && t - own->stepped_at > kTogether) own->step = 0;
  if (own->last > kNever && t > own->last) {
    own->intervals.push_back(t - own->last);
    if (own->intervals.size() > kIntervals) own->intervals.pop_front();
  }
}

bool StreamClock::steppedTogether(double t) const {
  double least = 1e300, most = 0, longest = 0;
  std::size_t running = 0;
  bool backward = false;  // streams that only became faster make no step
  for (const Stream& s : streams_) {
    if (s.newest < newest_ - kRunning) continue;
    if (!(s.step > 0) || std::abs(s.stepped_at - t) > kTogether) return false;
    ++running;
    backward = backward || s.backward;
    least = std::min(least, s.step);
    most = std::max(most, s.step);
    longest = std::max(longest, usualInterval(s.intervals));
  }
  return running >= 2 && backward && most - least <= kAgree * longest + kJitter;
}

}  // namespace vip_slam
