// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/stream_time/stream_time.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr double kLeastStep = 0.03;       // s; beyond jitter, and more than the filter's estimate of a delay takes
constexpr double kLeastOfInterval = 0.5;  // a step back by stamps alone is at least this part of the usual interval
constexpr double kLeap = 2.2;             // of the longest interval lately: two lost messages make no leap
constexpr std::size_t kIntervals = 9, kEnough = 5;    // intervals remembered, and needed to know the usual one
constexpr double kConfirmed = 0.05;                   // s of messages that confirm a step ...
constexpr int kFewestConfirm = 2, kMostConfirm = 10;  // ... at least and at most
constexpr std::size_t kGoneOn = 2;  // messages that show a stream to go on: one may have been on its way

// Largest number of late messages per stream, more than any subscriber queue holds; beyond, the stream's time is taken
// to be right.
constexpr int kMaxStragglers = 200;

/// Of a stream's intervals, s: robust against losses and single wrong stamps.
double usual(const std::deque<double>& intervals) {
  return upperMedian(std::vector<double>(intervals.begin(), intervals.end()));
}

}  // namespace

StreamTime::StreamTime(std::size_t streams, double jump, Listener listener)
    : streams_(streams), jump_(jump), listener_(std::move(listener)) {}

void StreamTime::take(std::size_t stream, double stamp, double arrival, Deliver deliver) {
  Stream& own = streams_.at(stream);
  Message message{stamp, arrival, taken_++, std::move(deliver)};
  if (straggles(&own, time(own, message))) return;
  admit(&own, std::move(message));
  settle();
}

void StreamTime::end() {
  for (auto& [own, message] : takeHeld()) pass(own, message);
}

void StreamTime::admit(Stream* own, Message message) {
  if (!own->held.empty() && goesOnAsBefore(*own, message)) {
    if (own->forward) {
      own->left_out.ahead += own->held.size();
      own->held.clear();
    } else {
      release(own, false);
    }
  } else if (!own->held.empty() && own->wait == Wait::kGap) {
    release(own);
  }
  if (!own->held.empty()) {
    own->held.push_back(std::move(message));
  } else if (waits(own, message)) {
    own->held.push_back(std::move(message));
    own->delivered_then.clear();
    for (const Stream& s : streams_) own->delivered_then.push_back(s.delivered);
  } else {
    pass(own, message);
  }
}

bool StreamTime::waits(Stream* own, const Message& message) const {
  const double t = time(*own, message);
  const bool known = own->intervals.size() >= kEnough;
  const double next = own->last + (known ? usual(own->intervals) : 0);
  own->wait = Wait::kGap;
  own->forward = true;
  own->by_arrival = false;
  if (own->last == kNever) return true;  // the first of a stream: only the second tells
  if (const auto excess = own->delay.excess(t, message.arrival); known && excess) {
    // Forward, it would have arrived before it was sent. Back, its stamp repeats time. No delay does either.
    own->forward = *excess > 0;
    own->by_arrival =
        own->forward ? *excess > kLeastStep && t > next + kLeastStep : *excess < -kLeastStep && t < next - kLeastStep;
  }
  const double least = known ? std::max(kLeastStep, kLeastOfInterval * (next - own->last)) : jump_;
  const bool back = t < next - least || t < own->newest - jump_;
  if (own->by_arrival || back) {
    own->wait = Wait::kStep;
    own->forward = !back && own->forward;
    return true;
  }
  own->forward = true;
  const double longest = known ? *std::max_element(own->intervals.begin(), own->intervals.end()) : 0;
  return known ? t - own->last > kLeap * longest : t > newest_ + jump_;
}

bool StreamTime::goesOnAsBefore(const Stream& own, const Message& message) const {
  const double t = time(own, message);
  const auto excess = [&own](double stamp, double arrival) { return own.delay.excess(stamp, arrival).value_or(0); };
  if (own.forward) {
    // A stamp that is ahead by less than an interval is seen by arrival alone.
    const Message& first = own.held.front();
    const double ahead = time(own, first);
    return t < ahead || (own.by_arrival && excess(t, message.arrival) < 0.5 * excess(ahead, first.arrival));
  }
  if (own.by_arrival) return excess(t, message.arrival) > -kLeastStep;
  if (own.intervals.size() < kEnough) return t >= own.newest - jump_;
  const double interval = usual(own.intervals);
  return t >= own.last + double(own.held.size() + 1) * interval - std::max(kLeastStep, kLeastOfInterval * interval);
}

void StreamTime::pass(Stream* own, const Message& message, bool follows) {
  const double t = time(*own, message);
  if (t < own->newest - jump_) {
    ++own->left_out.stray;
    return;
  }
  if (follows) {
    own->delay.add(t, message.arrival);
    if (own->last > kNever && t > own->last) {
      own->intervals.push_back(t - own->last);
      if (own->intervals.size() > kIntervals) own->intervals.pop_front();
    }
    own->last = t;
  }
  own->newest = std::max(own->newest, t);
  newest_ = std::max(newest_, t);
  ++own->delivered;
  message.deliver(t);
}

void StreamTime::release(Stream* own, bool follow) {
  const std::vector<Message> held = std::move(own->held);
  own->held.clear();
  for (const Message& message : held) pass(own, message, follow);
}

void StreamTime::settle() {
  if (settleTogether()) return;
  for (Stream& own : streams_) {
    if (!own.held.empty()) settleAlone(&own);
  }
}

double StreamTime::stepOf(const Stream& own) const {
  const double interval = own.intervals.empty() ? 0 : usual(own.intervals);
  const double since = time(own, own.held.front()) - own.last;
  double intervals = 1;
  if (own.by_arrival) {
    double by_delay = -1e300;
    for (const Message& m : own.held)
      by_delay = std::max(by_delay, own.delay.excess(time(own, m), m.arrival).value_or(0));
    intervals = std::max(1.0, std::round((since - by_delay) / interval));
  }
  return since - intervals * interval;
}

bool StreamTime::confirmed(const Stream& own) const {
  const double interval = own.intervals.empty() ? 1 : std::max(usual(own.intervals), 1e-3);
  const int needed = std::clamp(static_cast<int>(std::lround(kConfirmed / interval)), kFewestConfirm, kMostConfirm);
  return own.held.size() >= std::size_t(needed);
}

bool StreamTime::othersGoOn(const Stream& own) const {
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    const Stream& other = streams_[i];
    if (&other == &own || !running(other) || !other.held.empty()) continue;
    if (other.newest > own.last && other.delivered >= own.delivered_then[i] + kGoneOn) return true;
  }
  return false;
}

bool StreamTime::farBack(const Stream& own) const {
  return !own.forward && time(own, own.held.front()) < own.newest - jump_;
}

bool StreamTime::becameFaster(const Stream& own) const {
  if (own.by_arrival || !confirmed(own)) return false;
  return std::none_of(streams_.begin(), streams_.end(), [&](const Stream& s) {
    return !s.held.empty() && s.wait == Wait::kStep && (s.by_arrival || time(s, s.held.front()) < s.last);
  });
}

bool StreamTime::settleTogether() {
  Stream* fastest = nullptr;
  std::size_t running_streams = 0;
  bool clear = false, by_arrival = true;
  double least = 1e300, most = -1e300, longest = 0;
  for (Stream& s : streams_) {
    if (!running(s)) continue;
    if (s.held.empty() || s.wait != Wait::kStep || !confirmed(s)) return false;
    ++running_streams;
    // Streams that only became faster make no step.
    clear = clear || s.by_arrival || time(s, s.held.front()) < s.last;
    by_arrival = by_arrival && s.by_arrival;
    least = std::min(least, stepOf(s));
    most = std::max(most, stepOf(s));
    if (s.intervals.empty()) continue;
    longest = std::max(longest, usual(s.intervals));
    if (!fastest || usual(s.intervals) < usual(fastest->intervals)) fastest = &s;
  }
  // A message may be lost in the step.
  if (running_streams < 2 || !clear || !fastest || most - least > longest + kLeastStep) return false;
  const double seconds = stepOf(*fastest);
  // A large step back is a clock that was set where it undoes one ahead.
  if (farBack(*fastest) && std::abs(machine_shift_ - seconds) > jump_) {
    restart(fastest);
    return true;
  }
  machine_shift_ -= seconds;
  ClockStep set{std::nullopt, fastest->held.front().stamp, 1e300, seconds};
  for (Stream& s : streams_) {
    if (!s.held.empty()) set.time = std::min(set.time, time(s, s.held.front()));
    if (!by_arrival) s.delay.clear();  // the clock of arrival was set too
  }
  listener_.stepped(set);
  for (auto& [own, message] : takeHeld()) pass(own, message);
  return true;
}

void StreamTime::settleAlone(Stream* own) {
  if (own->wait == Wait::kGap) {
    if (newest_ > time(*own, own->held.front()) + kRunning) release(own);
    return;
  }
  const bool alone = std::none_of(streams_.begin(), streams_.end(),
                                  [&](const Stream& other) { return &other != own && running(other); });
  const bool overdue =
      newest_ > own->last + kRunning || time(*own, own->held.back()) - time(*own, own->held.front()) > kRunning;
  if (farBack(*own) && own->held.size() >= std::size_t(kFewestConfirm) && (!own->by_arrival || alone || overdue)) {
    restart(own);
  } else if (own->by_arrival && othersGoOn(*own)) {
    if (!confirmed(*own)) return;
    if (const double seconds = stepOf(*own); std::abs(seconds) > kLeastStep) {
      own->shift -= seconds;
      const Message& first = own->held.front();
      listener_.stepped({std::size_t(own - streams_.data()), first.stamp, time(*own, first), seconds});
    }
    release(own);
  } else if (othersGoOn(*own) || overdue || alone || becameFaster(*own)) {
    release(own);
  }
}

bool StreamTime::straggles(Stream* own, double t) {
  if (own->stragglers_left == 0) return false;
  // Stamps from before the restart are near where all streams were then; those after it are clearly below.
  if (t > newest_ + jump_ && t > own->before_restart - restarted_by_ / 2) {
    --own->stragglers_left;
    ++own->left_out.stray;
    return true;
  }
  own->stragglers_left = 0;
  return false;
}

void StreamTime::restart(Stream* own) {
  restarted_by_ = own->newest - time(*own, own->held.front());
  listener_.restarted(-stepOf(*own));
  const auto held = takeHeld();
  for (Stream& s : streams_) {
    const LeftOut left_out = s.left_out;
    s = Stream();
    s.left_out = left_out;
    s.before_restart = newest_;
    s.stragglers_left = &s == own ? 0 : kMaxStragglers;
  }
  for (const auto& [stream, message] : held) {
    if (stream != own) continue;
    newest_ = time(*own, message);
    break;
  }
  for (const auto& [stream, message] : held) {
    if (!straggles(stream, time(*stream, message))) admit(stream, message);
  }
}

std::vector<std::pair<StreamTime::Stream*, StreamTime::Message>> StreamTime::takeHeld() {
  std::vector<std::pair<Stream*, Message>> all;
  for (Stream& s : streams_) {
    for (Message& message : s.held) all.emplace_back(&s, std::move(message));
    s.held.clear();
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.second.number < b.second.number; });
  return all;
}

}  // namespace vip_slam
