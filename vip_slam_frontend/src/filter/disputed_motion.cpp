// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/disputed_motion.h"

#include <cmath>

namespace vip_slam::frontend {

namespace {

// The memory of fault detection, in which the share of contradicted time is judged, s.
constexpr double kMemory = 1.0;

}  // namespace

void DisputedMotion::add(double t, const Vector6d& correction, const Vector6d& removed) {
  const double kept = std::exp(-(t - t_) / kMemory);
  sum_ = kept * sum_ + correction;
  expected_ = kept * kept * expected_ + removed.cwiseMax(0.0);
  t_ = t;
}

Vector6d DisputedMotion::take() {
  const Vector6d excess = (sum_.cwiseAbs2() - expected_).cwiseMax(0.0);
  reset();
  return excess;
}

}  // namespace vip_slam::frontend
