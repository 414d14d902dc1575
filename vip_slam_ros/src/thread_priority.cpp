// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/thread_priority.h"

#ifdef __linux__
#include <algorithm>

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace vip_slam {

void lowerThreadPriority(int niceness) {
#ifdef __linux__
  constexpr int kNicest = 19;
  const auto thread = static_cast<id_t>(syscall(SYS_gettid));
  setpriority(PRIO_PROCESS, thread, std::min(getpriority(PRIO_PROCESS, thread) + niceness, kNicest));
#else
  (void)niceness;
#endif
}

}  // namespace vip_slam
