// Loop closing within the back end.
#include <algorithm>
#include <cmath>
#include <map>

#include "back_end_impl.h"

namespace vip_slam {
namespace {

constexpr double kRestSeconds = 15;
// Number of refused loops that are kept; a day has about a hundred thousand.
constexpr std::size_t kMaxRejected = 1000;

}  // namespace

void BackEnd::Impl::remember(const LoopEvent& event) {
  new_loops.push_back(event);
  loops.push_back(event);
  rejected_kept += !event.accepted;
  if (rejected_kept <= kMaxRejected) return;
  loops.erase(std::find_if(loops.begin(), loops.end(), [](const LoopEvent& e) { return !e.accepted; }));
  --rejected_kept;
}

void BackEnd::Impl::closeLoop(MapUpdate* update) {
  const KeyframeId id = map.newestKeyframe();
  loop_closer.add(map, id);
  if (!options.loop_closing) return;
  std::map<KeyframeId, SE3> before;  // of all, since the loop closer decides which part moves when two are joined
  for (const auto& entry : map.keyframes()) before.emplace(entry.first, entry.second.state.T_W_I);
  for (const LoopEvent& event : loop_closer.close(map, id)) {
    remember(event);
    if (!event.accepted) continue;
    followNewest();
    fillGlobal(update);
    // A loop that hardly moves anything does not need an adjustment at once: in a room that is seen again and again
    // each loop would cost a global one.
    const auto moved_far = [&](KeyframeId end) {
      const SE3 &then = before.at(end), &now = map.keyframe(end).state.T_W_I;
      return (then.inverse() * now).t().norm() > 0.02 || then.rotation().angularDistance(now.rotation()) > 0.005;
    };
    const double t = map.keyframe(id).data->frame.t;
    const bool far = moved_far(id) || moved_far(event.match);
    if (far) ++correction;  // small ones keep an adjustment valid, since they may be more frequent than it takes
    if (far || std::abs(t - last_global) > kRestSeconds) {  // stamps run back where a bag starts over
      global_wanted = true;
      last_global = t;
    }
  }
}

}  // namespace vip_slam
