// SPDX-License-Identifier: BSD-3-Clause
// Depth noise of RGB-D cameras: one-sigma error of the measured z as a function of z.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

namespace vip_slam {

enum class DepthSensorType { kProportional, kStructuredLight, kStereo, kTof };

/// "proportional", "structured_light", "stereo", "tof"; throws std::invalid_argument on others.
DepthSensorType depthSensorTypeFromName(const std::string& name);
std::string depthSensorTypeName(DepthSensorType type);

/// sigma(z) = a + b z + c z^2, metres. Which terms a type uses is its documentation: proportional b; structured light
/// and stereo a, c; ToF a, b.
struct DepthNoise {
  DepthSensorType type = DepthSensorType::kProportional;
  double a = 0.001;
  double b = 0.0017;
  double c = 0.0;
  double min_range = 0.2;  ///< metres; readings outside [min, max] are invalid
  double max_range = 10.0;
  double bias_floor = 0.005;  ///< least error that the pixels of one surface in one image share, metres

  double sigma(double z) const { return a + (b + c * z) * z; }
  /// One sigma of the error that all pixels of one surface in one image share, so that no average removes it. Mean
  /// depth of planes in single images errs by about the sigma of a single pixel on structured light and time of flight.
  double shared(double z) const { return std::max(bias_floor, sigma(z)); }
  bool inRange(double z) const { return z >= min_range && z <= max_range; }
  /// Depth up to which hardly any noisy reading falls outside the range, m. Farther off mainly readings that noise
  /// makes too short remain, and their mean is biased.
  double unbiasedRange() const { return max_range - 3.0 * sigma(max_range); }
  /// Defaults of a type: structured light after Khoshelham & Elberink 2012; stereo and ToF from data sheets.
  static DepthNoise preset(DepthSensorType type);
  std::string validate() const;
};

/// The two parts of a recording's depth noise, as factors on the variance sigma(z)^2 of a single reading. At first a
/// poor camera is assumed.
struct DepthNoiseParts {
  double white = 0.25;  ///< of the mean of a patch of a surface, some fifteen pixels wide; averages out over patches
  double shared = 1;    ///< of what all readings of a surface have in common in one image

  bool isUsable() const { return white > 0 && std::isfinite(white) && shared >= 0 && std::isfinite(shared); }
};

/// Distance in the image, in normalised coordinates, over which the correlation of the shared part falls by e: 64 px of
/// a Kinect, an Xtion and a LiDAR phone.
constexpr double kDepthCorrelationLength = 0.12;

/// Correlation of the shared errors of one place in two images that are so many seconds apart.
double sharedDepth(double seconds);

}  // namespace vip_slam
