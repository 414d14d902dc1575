// SPDX-License-Identifier: BSD-3-Clause
// Messages for people until somebody takes them: bounded, since nobody ever may.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace vip_slam {

/// Entries of a log; a day has about a hundred thousand refused loops.
constexpr std::size_t kMostKept = 1000;

class MessageLog {
 public:
  void add(const std::string& message);
  std::vector<std::string> take() { return std::exchange(messages_, {}); }

 private:
  std::vector<std::string> messages_;
};

}  // namespace vip_slam
