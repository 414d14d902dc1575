// SPDX-License-Identifier: BSD-3-Clause
// Losses of a squared, whitened residual.
#pragma once

#include <cmath>

namespace vip_slam {

/// rho(s) for the squared norm s; delta in sigmas, 0: plain squares.
inline double huberCost(double s, double delta) {
  return delta <= 0 || s <= delta * delta ? s : 2.0 * delta * std::sqrt(s) - delta * delta;
}

/// Square root of the weight of Geman and McClure's loss, close to zero far beyond `delta` sigmas. delta 0: plain
/// squares.
inline double redescendingScale(double s, double delta) { return delta <= 0 ? 1.0 : 1.0 / (1.0 + s / (delta * delta)); }

}  // namespace vip_slam
