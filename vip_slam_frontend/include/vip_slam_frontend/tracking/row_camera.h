// SPDX-License-Identifier: BSD-3-Clause
// The colour camera during one image. A rolling shutter reads the rows one after the other while the camera moves, so
// every row has a pose of its own. This class converts pixels to points seen from the pose at the stamp and back, so
// that the rest of the code can assume a global shutter.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

/// Between knots poses are interpolated linearly: at 5 rad/s a millisecond leaves 3e-6 rad. What is nearer to the stamp
/// than to the next knot is at the stamp.
constexpr double kKnotSeconds = 1e-3;

/// Readout times of an image's first and last row, seconds after the stamp that poses belong to.
struct Readout {
  double first = 0, last = 0;

  /// `seconds` from first to last row, centred `lag` seconds after that stamp.
  static Readout around(double seconds, double lag = 0) { return {lag - 0.5 * seconds, lag + 0.5 * seconds}; }
  /// Everything at the stamp.
  bool instant() const { return first == 0 && last == 0; }
};

/// Poses of the camera while an image is read, relative to its pose at the stamp.
class RowPoses {
 public:
  /// `nav`: state at the stamp. `imu`: samples around the readout and the stamp on the clock of `nav.t`; outside them
  /// the nearest is used. `T_I_C`: camera to IMU. `gravity` in m/s^2.
  RowPoses(const Readout& readout, const NavState& nav, const std::vector<ImuSample>& imu, const SE3& T_I_C,
           double gravity = 9.81);

  /// R and t of p_stamp = R p_row + t for the row read at `share` of the readout, 0 first and 1 last.
  void at(double share, Eigen::Matrix3d* R, Eigen::Vector3d* t) const;

 private:
  struct Knot {
    Eigen::Matrix3d R;
    Eigen::Vector3d t;
  };
  std::vector<Knot> knots_;  ///< evenly over the readout
};

class RowCamera {
 public:
  /// A global shutter.
  explicit RowCamera(std::shared_ptr<const CameraModel> camera) : camera_(std::move(camera)) {}
  RowCamera(std::shared_ptr<const CameraModel> camera, std::shared_ptr<const RowPoses> rows)
      : camera_(std::move(camera)), rows_(std::move(rows)) {}

  bool rolls() const { return rows_ != nullptr; }
  /// The pixel that sees a point given in the camera at the stamp: fixed point of row = projection at the row's time.
  /// False as CameraModel::project.
  bool project(const Eigen::Vector3d& p_stamp, Eigen::Vector2d* uv) const;
  /// The point, in the camera at the stamp, that a pixel sees where it is `z` metres in front of that camera.
  Eigen::Vector3d unproject(const Eigen::Vector2d& uv, double z) const;

 private:
  double share(double v) const { return (v + 0.5) / camera_->height(); }

  std::shared_ptr<const CameraModel> camera_;
  std::shared_ptr<const RowPoses> rows_;  ///< null: global shutter
};

}  // namespace vip_slam
