// SPDX-License-Identifier: BSD-3-Clause
// Keeps a topic to the sensor that it began with. When two drivers run under one name, or two bags were joined, images
// of two cameras come on one topic, and only their frame_id tells them apart.
#pragma once

#include <cstddef>
#include <string>

namespace vip_slam {

/// Not thread-safe.
class OneFrame {
 public:
  /// Whether a message may be used: its frame_id is that of the first one, a leading slash aside.
  bool admits(const std::string& frame_id);
  std::size_t leftOut() const { return left_out_; }
  /// What was left out and why, in words that follow "topic X: "; empty when nothing was.
  std::string words() const;

 private:
  std::string first_, other_;
  std::size_t admitted_ = 0, left_out_ = 0;
};

}  // namespace vip_slam
