// SPDX-License-Identifier: BSD-3-Clause
// Limits that restate a statistical fact, once for each meaning.
#pragma once

namespace vip_slam {

/// A deviation by more sigmas is not noise: 99.7 % of a normal distribution lie within.
constexpr double kNoiseSigmas = 3.0;

}  // namespace vip_slam
