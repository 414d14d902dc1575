// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/util/formatted.h"

#include <cstdarg>
#include <cstdio>

namespace vip_slam {

std::string formatted(const char* format, ...) {
  std::va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  va_end(arguments);
  std::string text(length > 0 ? static_cast<std::size_t>(length) : 0, '\0');
  // The terminating zero goes where the string has its own.
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(again);
  return text;
}

}  // namespace vip_slam
