// SPDX-License-Identifier: BSD-3-Clause
// Fault detection and isolation of the IMU. Each interval between two images has two witnesses of the camera's motion:
// the IMU, and the points with depth in the images. Their difference, in sigmas of both, is tested. The images are only
// heard when they agree among themselves: most points follow one motion, and nothing in view has moved by itself
// lately. Then the IMU is at fault in an interval
// - that contradicts them all of a sudden, after a time of agreement (a shock, saturation, shaking), and in those after
//   it for as long as they contradict, or
// - that contradicts them within a second after the IMU is believed again, or
// - when most of the last second does (axes, signs or units), or
// - when the filter has had to widen the IMU's noise beyond what any IMU has: then no difference is large in sigmas.
// After a fault it stays isolated for a moment, and for twice as long after each that comes back within a second.
// A body that fills the view contradicts the IMU gradually, while parts of the view still agree with it: neither rule
// takes it for a fault of the IMU.
#pragma once

#include <algorithm>

#include <Eigen/Core>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_frontend/tracking/predicted_motion.h"

namespace vip_slam::frontend {

/// For how long counts what images and IMU have said of each other, s.
constexpr double kFaultMemory = 1.0;

struct MotionEvidence {
  double t = 0;               ///< end of the interval, IMU clock, s
  double interval = 0;        ///< s
  bool images_agree = false;  ///< among themselves
  double sigmas = 0;          ///< difference between the two motions
  bool implausible = false;   ///< the noise that the filter had to assume of the IMU
  bool disputed = false;      ///< the filter's predictions of the last second contradict its updates
  double turn = 0;            ///< of the body by the images, rad
};

class FaultDetection {
 public:
  /// Adds one interval; whether the IMU is at fault in it.
  bool add(const MotionEvidence& evidence);
  /// Whether the IMU was at fault a moment before `t`: the images' prediction is the better one then.
  bool suspects(double t) const { return t - last_fault_t_ < isolation(); }
  /// Whether no turn has confirmed what the accelerometer said of the vertical, and turns have contradicted it (axes,
  /// signs, units). For good it is confirmed by a turn in agreement.
  bool verticalUnknown() const { return !vertical_confirmed_ && agreement_ < 0; }
  /// A start: no agreement has been seen yet.
  void reset(double t);

 private:
  /// For a while after it is believed again the IMU is at fault as soon as it contradicts.
  bool isOnProbation(double t) const;
  double isolation() const { return std::max(kMoment, isolated_); }

  double last_fault_t_ = -1e300;
  double disagreed_t_ = -1e300;  ///< images among themselves
  double doubt_t_ = -1e300;      ///< last interval that deviated, or that gave no test
  double began_t_ = -1e300;      ///< first such interval after agreement: a fault may begin there
  double contradicted_ = 0;      ///< share of the last second
  double isolated_ = 0;          ///< s for which the IMU stays isolated after a fault
  /// Until the vertical is confirmed: by how much further the body has turned in agreement than in contradiction,
  /// within the turn that shows the vertical, rad.
  double agreement_ = 0;
  bool vertical_confirmed_ = false;
};

/// Squared difference of two motions, T_current_previous, over their covariances (theta, t), as a number of sigmas.
double motionDifference(const SE3& a, const SE3& b, const Matrix6d& covariance);

}  // namespace vip_slam::frontend
