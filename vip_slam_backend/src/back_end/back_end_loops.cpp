// Loop closing within the back end.
#include "back_end_impl.h"

namespace vip_slam {

void BackEnd::Impl::closeLoop(MapUpdate* update) {
  const KeyframeId id = map.newestKeyframe();
  loop_closer.add(map, id);
  if (!options.loop_closing) return;
  for (const LoopEvent& event : loop_closer.close(map, id)) {
    (event.accepted ? statistics.loops_accepted : statistics.loops_rejected) += 1;
    loops.push_back(event);
    new_loops.push_back(event);
    if (!event.accepted) continue;
    followNewest();
    fillGlobal(update);
    global_wanted = true;
  }
}

}  // namespace vip_slam
