// The rate of turn at a time of the last seconds: an image's pose is of an instant that the IMU has long passed.
#pragma once

#include <deque>
#include <utility>

#include <Eigen/Core>

namespace vip_slam {

class GyroHistory {
 public:
  /// Samples that are not finite or not newer than the last are left out.
  void add(double t, const Eigen::Vector3d& gyro);
  /// Interpolated; the nearest outside of what is known, zero before the first sample. `t`: IMU clock, seconds.
  Eigen::Vector3d at(double t) const;
  void clear() { samples_.clear(); }

 private:
  std::deque<std::pair<double, Eigen::Vector3d>> samples_;
};

}  // namespace vip_slam
