// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/disputed_motion.h"

#include <cmath>

#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/inertial/fault_detection.h"

namespace vip_slam::frontend {

void DisputedMotion::add(double t, const Vector6d& correction, const Vector6d& removed) {
  const double kept = std::exp(-(t - t_) / kFaultMemory);
  sum_ = kept * sum_ + correction;
  expected_ = kept * kept * expected_ + removed.cwiseMax(0.0);
  taken_ *= kept * kept;
  t_ = t;
}

bool DisputedMotion::isSignificant() const {
  return (sum_.cwiseAbs2().array() > kGateSigmas * kGateSigmas * expected_.array()).any();
}

Vector6d DisputedMotion::take() {
  const Vector6d more = (sum_.cwiseAbs2() - expected_ - taken_).cwiseMax(0.0);
  taken_ += more;
  return more;
}

}  // namespace vip_slam::frontend
