// Depth noise of RGB-D cameras: one-sigma error of the measured z as a function of z.
#pragma once

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
  double bias_floor = 0.005;  ///< systematic error floor, metres, for measurements that pool many pixels

  double sigma(double z) const { return a + (b + c * z) * z; }
  bool inRange(double z) const { return z >= min_range && z <= max_range; }
  /// Depth up to which hardly any noisy reading falls outside the range, m. Farther off mainly readings that noise
  /// makes too short remain, and their mean is biased.
  double unbiasedRange() const { return max_range - 3.0 * sigma(max_range); }
  /// Defaults of a type: structured light after Khoshelham & Elberink 2012; stereo and ToF from data sheets.
  static DepthNoise preset(DepthSensorType type);
  std::string validate() const;
};

}  // namespace vip_slam
