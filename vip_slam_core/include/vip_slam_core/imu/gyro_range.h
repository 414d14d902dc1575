// A gyro at the end of its range says the same number again and again while the body turns faster.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <utility>

#include <Eigen/Core>

namespace vip_slam {

class GyroRange {
 public:
  /// A measurement as the sensor gave it, rad/s.
  void add(double t, const Eigen::Vector3d& rate);
  /// The end of the range, rad/s, when samples of the last seconds between t0 and t1 were cut off there; else 0.
  double cutOff(double t0, double t1) const;
  std::uint64_t samples() const { return samples_; }  ///< that were cut off, ever
  double end() const { return end_; }                 ///< of the range, rad/s, as last seen; 0: never

 private:
  struct Extreme {
    double value = 0;
    int count = 0;  ///< samples that have just this value
  };
  std::array<Extreme, 6> extremes_;  ///< of each axis, upwards and downwards
  std::deque<std::pair<double, double>> cut_;
  std::uint64_t samples_ = 0;
  double end_ = 0;
};

}  // namespace vip_slam
