// SPDX-License-Identifier: BSD-3-Clause
// Where a front end's numbers begin. One that is started again beside a back end that goes on must not use numbers that
// the map has already: its odometry is a new epoch, and what it sees are new keyframes and landmarks.
#pragma once

#include <cstdint>

#include "vip_slam_core/types/feature.h"
#include "vip_slam_core/types/keyframe.h"

namespace vip_slam {

struct SessionNumbers {
  std::uint32_t epoch = 0;
  KeyframeId keyframe = 1;
  LandmarkId landmark = 1;
};

/// `session` counts the starts: 0 for the first one. Numbers are used again after 256 starts. Epochs and landmarks stay
/// below those that a loaded map gets.
inline SessionNumbers firstNumbers(std::uint32_t session) {
  const std::uint32_t s = session % 256;
  return {s << 20, 1 + KeyframeId(s) * 10'000'000, 1 + (LandmarkId(s) << 32)};
}

}  // namespace vip_slam
