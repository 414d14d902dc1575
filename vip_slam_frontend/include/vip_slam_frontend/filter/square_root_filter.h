// SPDX-License-Identifier: BSD-3-Clause
// Square-root inverse filter algebra (Wu et al. 2015; algorithms as in the paper's front end): the cost |R x - r|^2 of
// the error state with R upper triangular, so P = R^-1 R^-T. After every update the correction is applied to the window
// and r is zero again.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/geometry/relative_motion.h"
#include "vip_slam_frontend/filter/propagation.h"
#include "vip_slam_frontend/filter/window_state.h"

namespace vip_slam {

struct UpdateResult {
  bool ok = false;  ///< false: nothing was changed (non-finite result)
  int rows = 0;
  double nis = 0;  ///< |e|^2, the normalised innovation squared of all rows
  Eigen::VectorXd delta;
};

class SquareRootFilter {
 public:
  /// `rows` are whitened prior rows on the whole state (at least dimension() of them, full rank).
  void initialise(const WindowState& window, const Eigen::MatrixXd& rows);

  WindowState& window() { return window_; }
  const WindowState& window() const { return window_; }
  const Eigen::MatrixXd& R() const { return R_; }

  /// Adds the new clone and nav state behind the IMU rows W [-Phi I] and marginalises the old nav state.
  /// `delay_change`: one sigma by which the delay may have changed since the newest clone, s; 0: it is the same.
  void augment(const Propagation& propagation, CloneId id, double delay_change = 0);
  /// Marginalises clones (indices ascending). Removing the oldest ones only deletes rows; others cost a QR.
  void marginalise(const std::vector<int>& clone_indices);

  /// Resets the marginal of the states from this column on to the given sigmas, independent of each other, at `change`
  /// from their present values; the conditional of the others given them is kept: what the marginal had learnt has gone
  /// elsewhere.
  void replaceMarginal(int column, const Eigen::VectorXd& change, const Eigen::VectorXd& sigmas);
  /// Takes back what an update did to the state in this column: `change` back to its value, and its sigma to the given
  /// one, while all others keep what they learnt (a consider state of the Schmidt-Kalman filter).
  void consider(int column, double change, double sigma);

  /// Covariance inflation by N N^T: the state is what it was taken for, plus N times independent unit variables.
  void inflate(const Eigen::MatrixXd& N);

  /// Whitened rows H x = h. Applies the correction to the window and clears r. `H` and `h` are used as work space.
  UpdateResult update(Eigen::MatrixXd& H, Eigen::VectorXd& h);

  /// Makes the present estimates the first estimates, where later Jacobians are evaluated.
  void relinearise();

  double sigma(int column) const;                          ///< of one state
  Eigen::MatrixXd covariance(int column, int size) const;  ///< of successive states
  /// One sigma of each calibration state.
  Eigen::VectorXd calibrationSigmas() const;
  /// Covariance of (theta, p, v, b_g, b_a) of the newest pose.
  Matrix15d navCovariance() const;
  /// The motion between two clones, by index, with its covariance: the unobservable position and yaw of the window
  /// cancel.
  RelativeMotion relativeMotion(int a, int b) const;
  /// Joint covariance of the whole state; for tests.
  Eigen::MatrixXd covariance() const;
  /// All diagonal entries of R finite and positive.
  bool healthy() const;

 private:
  WindowState window_;
  Eigen::MatrixXd R_;
};

/// The trailing (n - k) square triangle after sorting the columns by `order` (a permutation of A's columns whose first
/// k are to be marginalised) and triangularising. A may have more rows than columns.
Eigen::MatrixXd marginaliseColumns(const Eigen::MatrixXd& A, const std::vector<int>& order, int k);

}  // namespace vip_slam
