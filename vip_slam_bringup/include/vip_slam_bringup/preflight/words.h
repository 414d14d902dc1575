// Small helpers of the checks.
#pragma once

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

namespace vip_slam {

/// printf into a string.
template <class... Arguments>
std::string words(const char* format, Arguments... arguments) {
  char text[512];
  std::snprintf(text, sizeof(text), format, arguments...);
  return text;
}

/// Upper median; `values` must not be empty.
inline double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

inline double quantile(std::vector<double> values, double share) {
  const auto index = static_cast<std::ptrdiff_t>(share * (values.size() - 1));
  std::nth_element(values.begin(), values.begin() + index, values.end());
  return values[index];
}

}  // namespace vip_slam
