// SPDX-License-Identifier: BSD-3-Clause
// Fault detection and isolation of the IMU. Each interval between two images has two witnesses of the camera's motion:
// the IMU, and the points with depth in the images. Their difference, in sigmas of both, is tested. The images are only
// heard when they agree among themselves: most points follow one motion, and nothing in view has moved by itself
// lately. Then the IMU is at fault in an interval
// - that contradicts them all of a sudden, after a time of agreement (a shock, saturation, shaking), and in those after
//   it for as long as they contradict, or
// - with which the motions of the last half second contradict each other (axes, signs or units: imu_trial.h).
// It stays isolated until such trials have agreed for as long as its faults came back, half a second at the least. For
// twice as long after that it is on probation: a contradiction then is a fault that came back.
// A body that fills the view contradicts the IMU gradually, while parts of the view still agree with it: no trial
// counts within a second of that.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_frontend/inertial/imu_trial.h"
#include "vip_slam_frontend/tracking/predicted_motion.h"

namespace vip_slam::frontend {

/// For how long counts what images and IMU have said of each other, s.
constexpr double kFaultMemory = 1.0;

struct MotionEvidence {
  double t = 0;                      ///< end of the interval, IMU clock, s
  double interval = 0;               ///< s
  bool images_agree = false;         ///< among themselves
  double sigmas = 0;                 ///< difference between the two motions
  bool disputed = false;             ///< the filter's predictions of the last second contradict its updates
  double turn = 0;                   ///< of the body by the images, rad
  std::optional<TrialResult> trial;  ///< over the half second that ends with the interval
};

class FaultDetection {
 public:
  /// Adds one interval; whether the IMU is isolated in it, at fault or not believed again yet.
  bool add(const MotionEvidence& evidence);
  /// Whether the IMU was at fault a moment before `t`: the images' prediction is the better one then.
  bool suspects(double t) const { return isolated_ || t - last_fault_t_ < kMoment; }
  /// Whether no turn has confirmed what the accelerometer said of the vertical, and turns have contradicted it (axes,
  /// signs, units). For good it is confirmed by a turn in agreement.
  bool verticalUnknown() const { return !vertical_confirmed_ && agreement_ < 0; }
  /// A start: no agreement has been seen yet. `at_fault`: the IMU begins isolated.
  void reset(double t, bool at_fault = false);

 private:
  /// For a while after it is believed again the IMU is at fault as soon as it contradicts.
  bool isOnProbation(double t) const { return isolated_ || t - recovered_t_ < 2 * to_agree_; }
  /// Sigmas by which a trial fails. Of many independent ones one fails by chance: the probability of a false alarm is
  /// divided by their number (Bonferroni), so that an IMU which has passed trials for long is believed more firmly.
  double trialGate() const;

  double first_fault_t_ = -1e300, last_fault_t_ = -1e300;  ///< of those that came back on probation
  double disagreed_t_ = -1e300;                            ///< images among themselves
  double recovered_t_ = -1e300;                            ///< end of the last isolation
  double unconfirmed_t_ = -1e300;                          ///< last interval that deviated, or that gave no test
  double began_t_ = -1e300;  ///< first such interval after agreement: a fault may begin there
  bool isolated_ = false;
  double tried_ = 0;           ///< for how long it has been on trial without a fault, s
  double agreed_ = 0;          ///< for how long trials have agreed, while isolated, s
  double to_agree_ = kMoment;  ///< for how long they have to, as long as faults came back
  /// Until the vertical is confirmed: by how much further the body has turned in agreement than in contradiction,
  /// within the turn that shows the vertical, rad.
  double agreement_ = 0;
  bool vertical_confirmed_ = false;
};

}  // namespace vip_slam::frontend
