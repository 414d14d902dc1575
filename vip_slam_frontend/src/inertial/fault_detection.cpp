// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/inertial/fault_detection.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam::frontend {

namespace {

// The share of the last second from which on it is at fault. While a body may fill the view it is half of it.
constexpr double kSustained = 0.2;
// A turn by so much shows whether the vertical is right, rad: wrong axes make 3 m/s^2 of it.
constexpr double kShowsVertical = 0.3;

}  // namespace

double motionDifference(const SE3& a, const SE3& b, const Matrix6d& covariance) {
  const Vector6d d = a.boxminus(b);
  const double squared = d.dot(covariance.ldlt().solve(d));
  return std::isfinite(squared) ? std::sqrt(std::max(0.0, squared)) : 0.0;
}

bool FaultDetection::isOnProbation(double t) const { return t - last_fault_t_ < isolation() + kFaultMemory; }

void FaultDetection::reset(double t) {
  *this = FaultDetection();
  doubt_t_ = t;
}

bool FaultDetection::add(const MotionEvidence& e) {
  // Ordinary images reach the innovation gate in rendered sequences, and nearly twice of it on a real phone, whose
  // images have errors that no covariance knows.
  const bool deviates = e.images_agree && e.sigmas > 2 * kGateSigmas;
  const bool contradicts = e.images_agree && (e.implausible || deviates || (suspects(e.t) && e.sigmas > kGateSigmas));
  const double gain = std::min(1.0, e.interval / kFaultMemory);
  if (e.images_agree) contradicted_ += gain * (contradicts - contradicted_);
  if (!e.images_agree) disagreed_t_ = e.t;
  if (!e.images_agree || deviates) {
    if (e.t - doubt_t_ > kMoment) began_t_ = e.t;
    doubt_t_ = e.t;
  }
  // A shock may begin at the end of one interval and show fully in the next one.
  const bool begins = deviates && began_t_ == e.t;
  const bool goes_on = contradicts && (e.t - began_t_ <= 2.5 * e.interval || isOnProbation(e.t));
  const double share = e.t - disagreed_t_ > kFaultMemory ? kSustained : 0.5;
  const bool fault = begins || goes_on || (contradicts && contradicted_ > share);
  // An IMU whose faults come back is believed again later each time.
  if (fault) {
    const double since = e.t - last_fault_t_;
    if (since > isolation()) isolated_ = isOnProbation(e.t) ? 2 * isolation() : 0.0;
    last_fault_t_ = e.t;
  }
  const bool isolated = fault || (e.images_agree && e.t - last_fault_t_ < isolated_);
  if (e.images_agree && !vertical_confirmed_) {
    if (fault || e.disputed)
      agreement_ = std::max(agreement_ - e.turn, -kShowsVertical);
    else if (!deviates && !isOnProbation(e.t))
      agreement_ += e.turn;
    vertical_confirmed_ = agreement_ >= kShowsVertical;
  }
  return isolated;
}

}  // namespace vip_slam::frontend
