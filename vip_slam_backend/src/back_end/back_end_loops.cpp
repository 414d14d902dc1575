// SPDX-License-Identifier: BSD-3-Clause
// Loop closing within the back end.
#include <map>

#include "back_end_impl.h"

namespace vip_slam {

void BackEnd::Impl::closeLoop(MapUpdate* update) {
  const KeyframeId id = map.newestKeyframe();
  loop_closer.add(map, id);
  if (!options.loop_closing) return;
  std::map<KeyframeId, SE3> before;  // of all, since the loop closer decides which part moves when two are joined
  for (const auto& entry : map.keyframes()) before.emplace(entry.first, entry.second.state.T_W_I);
  for (const LoopEvent& event : loop_closer.close(map, id)) {
    report.loops.add(event);
    if (!event.accepted) continue;
    odometry.follow(map);
    fillGlobal(update);
    const auto moved_far = [&](KeyframeId end) {
      const SE3 &then = before.at(end), &now = map.keyframe(end).state.T_W_I;
      return (then.inverse() * now).t().norm() > 0.02 || then.rotation().angularDistance(now.rotation()) > 0.005;
    };
    global.loopClosed(moved_far(id) || moved_far(event.match));
  }
}

}  // namespace vip_slam
