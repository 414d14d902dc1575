// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/inertial/fault_detection.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam::frontend {

namespace {

// Of a single interval: twice the innovation gate. Ordinary images reach the gate in rendered sequences, and nearly
// twice of it on a real phone, whose images have errors that no covariance knows.
constexpr double kBeyond = 2 * kGateSigmas;
// Probability that a sound IMU fails one of its trials since its last fault.
constexpr double kFalseAlarm = 1e-3;
// A turn by so much shows whether the vertical is right, rad: wrong axes make 3 m/s^2 of it.
constexpr double kShowsVertical = 0.3;

}  // namespace

void FaultDetection::reset(double t, bool at_fault) {
  *this = FaultDetection();
  isolated_ = at_fault;
  if (at_fault) first_fault_t_ = last_fault_t_ = t;
  unconfirmed_t_ = t;
}

bool FaultDetection::add(const MotionEvidence& e) {
  const bool deviates = e.images_agree && e.sigmas > kBeyond;
  const bool contradicts = e.images_agree && e.sigmas > (suspects(e.t) ? kGateSigmas : kBeyond);
  if (!e.images_agree) disagreed_t_ = e.t;
  if (!e.images_agree || deviates) {
    if (e.t - unconfirmed_t_ > kMoment) began_t_ = e.t;
    unconfirmed_t_ = e.t;
  }
  // A shock may begin at the end of one interval and show fully in the next one.
  const bool begins = deviates && began_t_ == e.t;
  const bool goes_on = contradicts && (e.t - began_t_ <= 2.5 * e.interval || isOnProbation(e.t));
  const bool tried = e.trial && e.trial->duration >= kMoment;
  const bool agrees = tried && e.trial->sigmas < kGateSigmas;
  const bool fails = tried && e.t - disagreed_t_ > kFaultMemory && e.trial->sigmas > trialGate();
  const bool fault = begins || goes_on || fails;
  // Images that cannot tell neither confirm nor contradict.
  if (fault || (tried && !agrees)) agreed_ = 0;
  if (tried) tried_ += e.interval;
  if (fault) {
    tried_ = 0;
    if (!isOnProbation(e.t)) first_fault_t_ = e.t;
    isolated_ = true;
    last_fault_t_ = e.t;
    to_agree_ = std::max(kMoment, last_fault_t_ - first_fault_t_);
  } else if (isolated_ && agrees) {
    // A trial is of half a second, the next one of an interval more.
    agreed_ += agreed_ > 0 ? e.interval : kMoment;
    if (agreed_ >= to_agree_) {
      isolated_ = false;
      recovered_t_ = e.t;
    }
  }
  const bool isolated = fault || (e.images_agree && isolated_);
  if (e.images_agree && !vertical_confirmed_) {
    if (fault || e.disputed)
      agreement_ = std::max(agreement_ - e.turn, -kShowsVertical);
    else if (!deviates && !isOnProbation(e.t))
      agreement_ += e.turn;
    vertical_confirmed_ = agreement_ >= kShowsVertical;
  }
  return isolated;
}

double FaultDetection::trialGate() const {
  return std::sqrt(chiSquareQuantile(1 - kFalseAlarm / (1 + tried_ / kMoment), 6));
}

}  // namespace vip_slam::frontend
