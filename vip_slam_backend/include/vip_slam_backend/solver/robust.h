// Losses of a squared, whitened residual.
#pragma once

#include <cmath>

namespace vip_slam {

/// rho(s) for the squared norm s; delta in sigmas, 0: plain squares.
inline double huberCost(double s, double delta) {
  return delta <= 0 || s <= delta * delta ? s : 2.0 * delta * std::sqrt(s) - delta * delta;
}

/// sqrt(rho'(s)): factor on residual and Jacobian (as Ceres does for rho'' <= 0).
inline double huberScale(double s, double delta) {
  return delta <= 0 || s <= delta * delta ? 1.0 : std::sqrt(delta / std::sqrt(s));
}

/// sqrt of the weight of Geman and McClure's loss: what is far beyond `delta` sigmas does not count at all. 0: plain.
inline double redescendingScale(double s, double delta) { return delta <= 0 ? 1.0 : 1.0 / (1.0 + s / (delta * delta)); }

}  // namespace vip_slam
