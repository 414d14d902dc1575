// SPDX-License-Identifier: BSD-3-Clause
#include "message_log.h"

namespace vip_slam {

void MessageLog::add(const std::string& message) {
  messages_.push_back(message);
  if (messages_.size() > kMostKept) messages_.erase(messages_.begin());
}

}  // namespace vip_slam
