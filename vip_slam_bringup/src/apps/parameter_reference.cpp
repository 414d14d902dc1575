// rosrun vip_slam_bringup parameter_reference > docs/parameters.md
#include <cstdio>

#include "vip_slam_bringup/parameter_reference.h"

int main() {
  std::fputs(vip_slam::parameterReference().c_str(), stdout);
  return 0;
}
