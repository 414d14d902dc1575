// Depth noise of RGB-D cameras: one-sigma error of the measured z as a function of z.
#pragma once

#include <algorithm>
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

/// Factors on the variances of a recording's depth noise: of the white part, sigma(z), and of shared(z).
struct DepthNoiseParts {
  double white = 1, shared = 1;
};

}  // namespace vip_slam
