// SPDX-License-Identifier: BSD-3-Clause
// In which unit a file's stamps are written.
#pragma once

#include <cstddef>

namespace vip_slam {

/// Seconds in one unit of ascending stamps from `first` to `last`, of which there are `count`. By their size, where
/// they count from 1970: nanoseconds, microseconds, milliseconds or seconds; where they count from the start of a
/// recording nanoseconds are told by their steps.
inline double secondsPerUnit(double first, double last, std::size_t count) {
  // A day in 2001 is 1e9 s; that of the year 5138 is 1e11 s.
  if (last > 1e17) return 1e-9;
  if (last > 1e14) return 1e-6;
  if (last > 1e11) return 1e-3;
  constexpr double kStep = 1e5;  // no sensor has a reading a day in seconds; in nanoseconds this is 10 kHz
  const bool nanoseconds = count > 1 && (last - first) / static_cast<double>(count - 1) > kStep;
  return nanoseconds ? 1e-9 : 1.0;
}

}  // namespace vip_slam
