// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/process_memory.h"

#include <unistd.h>

#include <fstream>

namespace vip_slam {

double processMemoryMb() {
  std::ifstream file("/proc/self/statm");
  long total = 0, resident = 0;
  if (!(file >> total >> resident)) return 0;
  return double(resident) * double(sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

}  // namespace vip_slam
