// SPDX-License-Identifier: BSD-3-Clause
// The filter's state: [C_1 ... C_M | calibration | E]. C = (theta, p) of the IMU at image times (oldest first, newest =
// present pose), E = (v, b_g, b_a), calibration = the estimated ones of (theta_IC, t_IC, td, depth offset, depth
// scale, depth delay, readout, bearing correction, depth shift, gyro correction).
// Rotations are perturbed on the right, positions in the world.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "vip_slam_core/camera/bearing_correction.h"
#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_frontend/filter/rate_history.h"

namespace vip_slam {

using CloneId = std::uint64_t;

/// IMU pose at one image.
struct Clone {
  CloneId id = 0;
  double t = 0;   ///< IMU time at which the pose holds
  SE3 T_W_I;      ///< estimate
  SE3 T_W_I_fej;  ///< first estimate, right after propagation; all Jacobians are evaluated there
  Eigen::Vector3d omega_I = Eigen::Vector3d::Zero();  ///< rad/s, for the delay's Jacobian
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();      ///< m/s, same
  double time_offset = 0;  ///< td from which t was computed, s; a later td' moves the pose along by (td' - td)
};

struct CalibrationFlags {
  bool rotation = false, translation = false, time_offset = false, depth_offset = false;
  bool depth_scale = false, depth_delay = false, readout = false;
  bool intrinsics = false, depth_shift = false;
  bool gyro_scale = false, gyro_misalignment = false;
  /// Number of the camera's calibration states, on which the measurements depend.
  int camera() const {
    return (rotation ? 3 : 0) + (translation ? 3 : 0) + (time_offset ? 1 : 0) + (depth_offset ? 1 : 0) +
           (depth_scale ? 1 : 0) + (depth_delay ? 1 : 0) + (readout ? 1 : 0) + (intrinsics ? 4 : 0) +
           (depth_shift ? 2 : 0);
  }
  int gyro() const { return (gyro_scale ? 3 : 0) + (gyro_misalignment ? 6 : 0); }
  int size() const { return camera() + gyro(); }
};

/// Row and column, in the gyro's correction matrix, of its estimated entry number `index`.
std::pair<int, int> gyroEntry(const CalibrationFlags& calibration, int index);

struct WindowState {
  std::vector<Clone> clones;
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_W_fej = Eigen::Vector3d::Zero();  ///< right after propagation
  Eigen::Vector3d bias_gyro = Eigen::Vector3d::Zero();
  Eigen::Vector3d bias_accel = Eigen::Vector3d::Zero();
  SE3 T_I_C;
  double time_offset = 0;
  double depth_offset = 0;    ///< m, to be added to every reading of the depth camera
  double depth_scale = 1;     ///< times every reading, before the offset
  double depth_delay = 0;     ///< s by which depth shows an earlier moment than the reader has taken it for
  double readout = 0;         ///< s that reading the rows takes beyond what the tracker has taken it for
  BearingCorrection bearing;  ///< correction of the camera's intrinsics
  /// Shift of the depth image to the right and down against the colour image, in bearings: depth read at bearing b
  /// belongs to b - shift.
  Eigen::Vector2d depth_shift = Eigen::Vector2d::Zero();
  Eigen::Matrix3d gyro_correction = Eigen::Matrix3d::Zero();  ///< see gyro_correction.h
  CalibrationFlags calibration;
  RateHistory rates;  ///< angular rates up to the newest clone

  int cloneColumn(int index) const { return 6 * index; }
  int calibrationColumn() const { return 6 * static_cast<int>(clones.size()); }
  int navColumn() const { return calibrationColumn() + calibration.size(); }
  int dimension() const { return navColumn() + 9; }
  /// Columns of single calibration states; meaningless when the state is not estimated.
  int rotationColumn() const { return calibrationColumn(); }
  int translationColumn() const { return calibrationColumn() + (calibration.rotation ? 3 : 0); }
  int timeOffsetColumn() const { return translationColumn() + (calibration.translation ? 3 : 0); }
  int depthOffsetColumn() const { return timeOffsetColumn() + (calibration.time_offset ? 1 : 0); }
  int depthScaleColumn() const { return depthOffsetColumn() + (calibration.depth_offset ? 1 : 0); }
  int depthDelayColumn() const { return depthScaleColumn() + (calibration.depth_scale ? 1 : 0); }
  int readoutColumn() const { return depthDelayColumn() + (calibration.depth_delay ? 1 : 0); }
  int intrinsicsColumn() const { return readoutColumn() + (calibration.readout ? 1 : 0); }
  int depthShiftColumn() const { return intrinsicsColumn() + (calibration.intrinsics ? 4 : 0); }
  /// The correction's diagonal (scale), then its off-diagonal entries (misalignment), if estimated: see gyroEntry().
  int gyroColumn() const { return calibrationColumn() + calibration.camera(); }

  /// Depth z for a reading of the depth camera, m.
  double trueDepth(double reading) const { return depth_scale * reading + depth_offset; }
  /// Index of the clone, -1 when it is not in the window.
  int indexOf(CloneId id) const;
  NavState nav() const;
  /// x <- x boxplus delta; delta has dimension() entries.
  void boxplus(const Eigen::VectorXd& delta);
  bool isFinite() const;
};

}  // namespace vip_slam
