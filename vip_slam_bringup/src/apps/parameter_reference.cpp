// SPDX-License-Identifier: BSD-3-Clause
// rosrun vip_slam_bringup parameter_reference > docs/parameters.md
#include <cstdio>

#include "vip_slam_bringup/parameter_reference.h"
#include "vip_slam_core/util/command_line.h"

int main(int argc, char** argv) {
  const vip_slam::CommandLine line("parameter_reference", "Prints all parameters with their defaults and ranges.");
  if (const auto status = line.parse(argc, argv)) return *status;
  std::fputs(vip_slam::parameterReference().c_str(), stdout);
  return 0;
}
