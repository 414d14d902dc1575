// SPDX-License-Identifier: BSD-3-Clause
// The IMU on trial over half a second. Between two images an accelerometer in wrong axes errs by millimetres, which the
// uncertain velocity explains; over half a second it errs by decimetres. From the filter's state at each image on, what
// the IMU measured is integrated beside the filter, and compared with the motion that the images show in the meantime.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_frontend/filter/propagation.h"
#include "vip_slam_frontend/filter/window_state.h"
#include "vip_slam_frontend/tracking/outlier_rejection.h"

namespace vip_slam::frontend {

/// Outcome of a trial.
struct TrialResult {
  double duration = 0;  ///< s, kMoment when there have been enough images
  double sigmas = 0;    ///< by which the motions differ
};

class ImuTrial {
 public:
  /// Adds the interval from the filter's newest image, whose state is `window` with the covariance `P` (theta, p, v,
  /// b_g, b_a), to the next one: `samples` as measured, first and last at the two images, and the camera's `motion` by
  /// the images. The result over up to half a second that ends with it; nothing when there are no samples.
  std::optional<TrialResult> add(const WindowState& window, const Matrix15d& P, const std::vector<ImuSample>& samples,
                                 const MotionFit& motion, const ImuNoise& noise, double gravity);
  /// What the motion up to the newest interval may be wrong by, when the IMU is found to be at fault in that one: by
  /// how much the trial before it differs beyond chance.
  const RefutedMotion& refuted() const { return refuted_; }
  /// The next interval does not follow on the last one.
  void reset() { *this = ImuTrial(); }

 private:
  struct Start {
    WindowState window;  ///< with the clone that it begins from alone
    Matrix15d P;
    std::vector<ImuSample> samples;
    SE3 T_now_start;                         ///< of the camera, by the images
    Matrix6d covariance = Matrix6d::Zero();  ///< of T_now_start, (theta, t)
    double duration() const { return samples.back().t - samples.front().t; }
  };
  std::deque<Start> starts_;      ///< oldest first
  RefutedMotion last_, refuted_;  ///< by the newest trial, by the one before
};

}  // namespace vip_slam::frontend
