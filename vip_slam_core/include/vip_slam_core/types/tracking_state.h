// SPDX-License-Identifier: BSD-3-Clause
// The tracking state of every published pose.
#pragma once

#include <string>

namespace vip_slam {

enum class TrackingState { kWaiting = 0, kInitialising = 1, kTracking = 2, kDegraded = 3, kLost = 4 };

inline const char* trackingStateName(TrackingState state) {
  switch (state) {
    case TrackingState::kWaiting:
      return "WAITING";
    case TrackingState::kInitialising:
      return "INITIALISING";
    case TrackingState::kTracking:
      return "TRACKING";
    case TrackingState::kDegraded:
      return "DEGRADED";
    case TrackingState::kLost:
      return "LOST";
  }
  return "UNKNOWN";
}

/// Whether the pose is valid in this state.
inline bool hasPose(TrackingState state) {
  return state == TrackingState::kTracking || state == TrackingState::kDegraded;
}

struct TrackingStatus {
  TrackingState state = TrackingState::kWaiting;
  std::string reason;  ///< as text, empty while TRACKING
};

}  // namespace vip_slam
