// SPDX-License-Identifier: BSD-3-Clause
// Correction of a depth camera's distance-dependent error that is neither an offset nor a scale, such as the periodic
// error of a time-of-flight camera: a table over the reading, linear in between; positive where it reads too short.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/bearing_correction.h"
#include "vip_slam_core/depth/depth_shift.h"

namespace vip_slam {

struct DepthCurve {
  static constexpr double kStep = 0.125;    ///< m
  static constexpr double kMaxEntry = 1.0;  ///< m, largest entry; a larger one cannot be an error of the camera

  std::vector<float> added;  ///< m, for readings of 0, kStep, 2 kStep, ...; constant beyond the last; empty: zero

  bool empty() const { return added.empty(); }
  /// Correction to be added to a reading of `z` m.
  float at(float z) const {
    if (added.empty()) return 0.f;
    const float k = z > 0 ? z / static_cast<float>(kStep) : 0.f;
    const auto last = static_cast<float>(added.size() - 1);
    if (!(k < last)) return added.back();
    const auto i = static_cast<std::size_t>(k);
    const float share = k - static_cast<float>(i);
    return (1 - share) * added[i] + share * added[i + 1];
  }
  bool operator==(const DepthCurve& other) const { return added == other.added; }
  bool operator!=(const DepthCurve& other) const { return !(*this == other); }
};

/// Both in one curve: `first` applied to the readings, `then` to the result.
DepthCurve chained(const DepthCurve& first, const DepthCurve& then);

/// Message on what is wrong, empty when nothing is: entries that are not finite or beyond kMaxEntry, or that fall so
/// steeply that two readings give the same depth.
std::string validateDepthCurve(const DepthCurve& curve);

/// In place; 32FC1, 0 and NaN stay.
void applyDepthCurve(const DepthCurve& curve, cv::Mat* depth);

/// All corrections of a camera's depth readings and bearings.
struct CameraCorrection {
  double offset = 0;  ///< m, after curve and scale
  DepthCurve curve;
  BearingCorrection bearing;
  DepthShift shift;  ///< applied when depth was read
  double scale = 1;  ///< factor, after the curve

  bool operator==(const CameraCorrection& other) const {
    return offset == other.offset && curve == other.curve && bearing == other.bearing && shift == other.shift &&
           scale == other.scale;
  }
  bool operator!=(const CameraCorrection& other) const { return !(*this == other); }
};

/// Converts a depth with one correction to the depth with another.
class DepthChange {
 public:
  DepthChange(const CameraCorrection& from, const CameraCorrection& to);
  /// 0 (no depth) stays 0; any other depth stays positive.
  float operator()(float z) const;

 private:
  CameraCorrection from_, to_;
  bool same_curve_;
};

}  // namespace vip_slam
