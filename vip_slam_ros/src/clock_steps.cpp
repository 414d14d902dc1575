#include "vip_slam_ros/clock_steps.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/formatted.h"

#include "usual_interval.h"

namespace vip_slam {
namespace {

constexpr double kLeastStep = 0.03;       // s; smaller steps are an error of the delay, which the filter estimates
constexpr std::size_t kSecondsKept = 60;  // seconds in which the least delay is looked for
constexpr std::size_t kSecondsKnown = 5;  // seconds after which it is known
constexpr std::size_t kIntervalsKept = 9;
constexpr double kConfirmed = 0.05;                   // s of messages that confirm a step ...
constexpr int kFewestConfirm = 2, kMostConfirm = 10;  // ... at least and at most
constexpr double kStillRunning = 1.0;                 // s without a message after which a stream is not asked

}  // namespace

ClockSteps::ClockSteps(std::size_t streams, double longest) : streams_(streams), longest_(longest) {}

double ClockSteps::leastDelay(const Stream& own) { return *std::max_element(own.ahead.begin(), own.ahead.end()); }

void ClockSteps::pass(Stream* own, double t, double arrival) {
  learn(own, t);
  if (own->arrived > -1e300 && t > own->last) {
    own->intervals.push_back(t - own->last);
    if (own->intervals.size() > kIntervalsKept) own->intervals.pop_front();
  }
  own->last = t;
  own->arrived = arrival;
  own->pending = 0;
}

void ClockSteps::learn(Stream* own, double t) const {
  // Only what the next message confirms: a single wrong stamp would show a delay that nothing has.
  if (!(own->arrived > -1e300) || t <= own->last || t - own->last > kStillRunning) return;
  if (own->ahead.empty() || own->arrived - own->second >= 1 || own->arrived < own->second) {
    own->second = own->arrived;
    own->ahead.push_back(own->last - own->arrived);
    if (own->ahead.size() > kSecondsKept) own->ahead.pop_front();
  }
  own->ahead.back() = std::max(own->ahead.back(), own->last - own->arrived);
}

bool ClockSteps::begins(const Stream& own, double t, double arrival) const {
  if (own.ahead.size() <= kSecondsKnown || own.intervals.size() < kIntervalsKept) return false;
  // Played at another rate, or on a machine that is too busy, arrival does not tell.
  const auto [low, high] =
      std::minmax_element(own.ahead.end() - 1 - std::ptrdiff_t(kSecondsKnown), own.ahead.end() - 1);
  if (*high - *low > kLeastStep) return false;
  const double interval = usualInterval(own.intervals);
  const double step = (t - arrival) - leastDelay(own);
  if (std::abs(step) > longest_) return false;
  // Forward a message would have arrived before it was sent: no delay does that. Back its stamp repeats time: a delay
  // does not either.
  return step > kLeastStep ? t > own.last + interval + kLeastStep
                           : step < -kLeastStep && t < own.last + interval - kLeastStep;
}

std::optional<bool> ClockSteps::alone(const Stream& own, double arrival) const {
  bool others = false;
  for (const Stream& s : streams_) {
    if (&s == &own || arrival - std::max(s.arrived, s.first_arrival) > kStillRunning) continue;
    if (s.pending > 0) continue;  // of the same device, or of all
    // A message on its way when the clock was set shows nothing.
    if (s.last <= own.last || s.arrived <= own.first_arrival + (s.intervals.empty() ? 0 : usualInterval(s.intervals)))
      return std::nullopt;
    others = true;
  }
  return others;
}

std::optional<double> ClockSteps::follow(std::size_t stream, double t, double arrival) {
  Stream& own = streams_.at(stream);
  const double shifted = t + own.shift;
  bool open = own.pending == 0 && begins(own, shifted, arrival);
  if (own.pending > 0) {
    // It is none when stamps go on from before it, the first having been wrong alone, or when one arrives as before.
    const bool back = own.first - own.first_arrival < leastDelay(own);
    const bool as_before = back ? shifted - arrival > leastDelay(own) - kLeastStep : shifted < own.first;
    open = !as_before && arrival - own.first_arrival < kStillRunning;
  }
  if (!open) {
    pass(&own, shifted, arrival);
    return shifted;
  }
  if (own.pending++ == 0) {
    own.first = shifted;
    own.given = t;
    own.first_arrival = arrival;
    own.best = shifted - arrival;
  }
  own.best = std::max(own.best, shifted - arrival);
  const double interval = usualInterval(own.intervals);
  const int needed =
      std::clamp(static_cast<int>(std::lround(kConfirmed / std::max(interval, 1e-3))), kFewestConfirm, kMostConfirm);
  if (own.pending < needed) return std::nullopt;
  const std::optional<bool> single = alone(own, arrival);
  if (!single) return std::nullopt;
  if (!*single) {
    for (Stream& s : streams_) {
      s.pending = 0;
      s.ahead.clear();
    }
    pass(&own, shifted, arrival);
    return shifted;
  }
  // By the delays, and to the nearest whole number of intervals since the last message.
  const double by_delay = own.best - leastDelay(own);
  const double since = own.first - own.last;
  const double intervals = std::max(1.0, std::round((since - by_delay) / interval));
  const double step = since - intervals * interval;
  if (std::abs(step) < kLeastStep) {
    pass(&own, shifted, arrival);
    return shifted;
  }
  own.shift -= step;
  steps_.push_back({stream, own.given, step});
  pass(&own, t + own.shift, arrival);
  return t + own.shift;
}

std::string clockStepped(const ClockSteps::Step& step, const std::string& topic) {
  return formatted(
      "topic %s: its clock was set %s by %.3f s at stamp %.3f s, alone, as the arrival of its messages "
      "shows: later stamps are taken on its clock before",
      topic.c_str(), step.seconds < 0 ? "back" : "forward", std::abs(step.seconds), step.t);
}

}  // namespace vip_slam
