// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/depth/depth_noise.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "util/text.h"

namespace vip_slam {
namespace {

constexpr double kSharedSeconds = 1.0;

}  // namespace

double sharedDepth(double seconds) { return std::max(0.0, 1 - std::abs(seconds) / kSharedSeconds); }

DepthSensorType depthSensorTypeFromName(const std::string& name) {
  if (name == "proportional") return DepthSensorType::kProportional;
  if (name == "structured_light") return DepthSensorType::kStructuredLight;
  if (name == "stereo") return DepthSensorType::kStereo;
  if (name == "tof") return DepthSensorType::kTof;
  throw std::invalid_argument("depth sensor type '" + name +
                              "' is unknown, expected proportional, structured_light, stereo or tof");
}

std::string depthSensorTypeName(DepthSensorType type) {
  switch (type) {
    case DepthSensorType::kProportional:
      return "proportional";
    case DepthSensorType::kStructuredLight:
      return "structured_light";
    case DepthSensorType::kStereo:
      return "stereo";
    case DepthSensorType::kTof:
      return "tof";
  }
  return "unknown";
}

DepthNoise DepthNoise::preset(DepthSensorType type) {
  DepthNoise noise;
  noise.type = type;
  switch (type) {
    case DepthSensorType::kProportional:
      break;  // the simulated camera of the paper: 0.17 % of z
    case DepthSensorType::kStructuredLight:
      // Khoshelham & Elberink 2012, Kinect v1: sigma_z = 1.425e-3 z^2 (metres); the constant is its quantisation floor.
      noise.a = 0.001, noise.b = 0, noise.c = 1.425e-3, noise.min_range = 0.5, noise.max_range = 5.0;
      noise.bias_floor = 0.005;
      break;
    case DepthSensorType::kStereo:
      // sigma_z = z^2 sigma_d / (f B) with f = 640 px (848x480 scaled), B = 50 mm, sigma_d = 0.08 px: D435 class.
      noise.a = 0.001, noise.b = 0, noise.c = 2.5e-3, noise.min_range = 0.3, noise.max_range = 6.0;
      noise.bias_floor = 0.008;
      break;
    case DepthSensorType::kTof:
      // Azure Kinect class: random error up to 17 mm at the far end, systematic error 11 mm + 0.1 % of z.
      noise.a = 0.002, noise.b = 0.0025, noise.c = 0, noise.min_range = 0.25, noise.max_range = 5.5;
      noise.bias_floor = 0.010;
      break;
  }
  return noise;
}

std::string DepthNoise::validate() const {
  const auto bad = [](double x) { return !(x >= 0) || !std::isfinite(x); };
  if (bad(a)) return "a must be >= 0, is " + formatDouble(a);
  if (bad(b)) return "b must be >= 0, is " + formatDouble(b);
  if (bad(c)) return "c must be >= 0, is " + formatDouble(c);
  if (a + b + c <= 0) return "a, b and c must not all be 0";
  if (bad(bias_floor)) return "bias_floor must be >= 0, is " + formatDouble(bias_floor);
  if (bad(min_range)) return "min_range must be >= 0, is " + formatDouble(min_range);
  if (!(max_range > min_range) || !std::isfinite(max_range)) {
    return "max_range must be above min_range (" + formatDouble(min_range) + "), is " + formatDouble(max_range);
  }
  return "";
}

}  // namespace vip_slam
