// SPDX-License-Identifier: BSD-3-Clause
// The exposure control of a camera: exposure time and gain follow the brightness of what is seen, with delay. Darker
// scenes have longer exposures (more blur) up to the longest, then more gain (more noise).
#pragma once

#include <vector>

namespace vip_slam {

struct Exposure {
  double gain = 1;   ///< of the image, against an exposure of the longest time without gain
  double noise = 1;  ///< growth of the noise
  double time = 0;   ///< s
};

class AutoExposure {
 public:
  /// `brightness`: mean radiance of the view every kStep seconds from 0 on. `exposure`: gain of the image at the
  /// `longest` exposure time.
  AutoExposure(const std::vector<double>& brightness, double exposure, double longest);
  Exposure at(double t) const;

  static constexpr double kStep = 0.1;  ///< s

 private:
  double exposure_, longest_;
  std::vector<double> gain_;  ///< every kStep seconds
};

}  // namespace vip_slam
