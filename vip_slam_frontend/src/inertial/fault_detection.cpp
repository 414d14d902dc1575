// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/inertial/fault_detection.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace vip_slam::frontend {

namespace {

// Innovation gate, sigmas: ordinary images reach four in rendered sequences, and seven on a real phone, whose images
// have errors that no covariance knows.
constexpr double kGate = 8.0;
// A fault is sudden: for kCalm s before it differences stayed below this share of the gate.
constexpr double kCalm = 0.5, kDeviates = 0.7;
constexpr double kMemory = 1.0;  // s, of the share of contradicted time

}  // namespace

double motionDifference(const SE3& a, const SE3& b, const Matrix6d& covariance) {
  const Vector6d d = a.boxminus(b);
  const double squared = d.dot(covariance.ldlt().solve(d));
  return std::isfinite(squared) ? std::sqrt(std::max(0.0, squared)) : 0.0;
}

void FaultDetection::reset(double t) {
  *this = FaultDetection();
  doubt_t_ = t;
}

bool FaultDetection::add(const MotionEvidence& e) {
  const bool contradicts = e.images_agree && (e.implausible || e.sigmas > kGate);
  const double gain = std::min(1.0, e.interval / kMemory);
  if (e.images_agree) contradicted_ += gain * (contradicts - contradicted_);
  const bool deviates = e.images_agree && e.sigmas > kDeviates * kGate;
  if (!e.images_agree || deviates) {
    if (e.t - doubt_t_ > kCalm) began_t_ = e.t;
    doubt_t_ = e.t;
  }
  // A shock may begin at the end of one interval and show fully in the next one.
  const bool begins = deviates && began_t_ == e.t;
  const bool goes_on = contradicts && (e.t - began_t_ <= 2.5 * e.interval || suspects(e.t));
  const bool fault = begins || goes_on || (contradicts && contradicted_ > 0.5);
  if (fault && contradicts) last_fault_t_ = e.t;
  return fault;
}

}  // namespace vip_slam::frontend
