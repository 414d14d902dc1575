// Small helpers of the checks.
#pragma once

#include <cstdio>
#include <string>

namespace vip_slam {

/// printf into a string.
template <class... Arguments>
std::string words(const char* format, Arguments... arguments) {
  char text[512];
  std::snprintf(text, sizeof(text), format, arguments...);
  return text;
}

}  // namespace vip_slam
