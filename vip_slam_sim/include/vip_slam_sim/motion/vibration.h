// SPDX-License-Identifier: BSD-3-Clause
// Fast shake of a body, as sums of sines in bands: of a drone's rotors, of a hand. It moves body, camera and IMU alike;
// the IMU samples it without a filter.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace vip_slam {

/// Displacement and small turn of the body in its own frame, with derivatives. SI.
struct VibrationState {
  Eigen::Vector3d p, v, a;                   ///< m, m/s, m/s^2
  Eigen::Vector3d turn, rate, acceleration;  ///< rad, rad/s, rad/s^2
};

class Vibration {
 public:
  /// `kind`: rotors or hand. Throws std::invalid_argument on another.
  Vibration(const std::string& kind, int seed);
  VibrationState at(double t) const;

 private:
  struct Tone {
    double omega;
    Eigen::Vector3d p, turn, phase_p, phase_turn;  ///< amplitudes and phases per axis
  };
  std::vector<Tone> tones_;
};

}  // namespace vip_slam
