// What a depth camera reads too short at each distance (negative: too long), where that is neither an offset nor a
// scale: the wiggle of a time-of-flight camera over range. A table over the reading, linear in between.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/bearing_correction.h"
#include "vip_slam_core/depth/depth_shift.h"

namespace vip_slam {

struct DepthCurve {
  static constexpr double kStep = 0.125;  ///< m
  static constexpr double kMost = 1.0;    ///< m of any entry; so much more is no error but another sensor

  std::vector<float> added;  ///< m, for readings of 0, kStep, 2 kStep, ...; beyond the last as there; empty: nothing

  bool empty() const { return added.empty(); }
  /// What a reading of `z` m has to be added.
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

/// Both at once: `first` for the readings, `then` for what comes of them.
DepthCurve chained(const DepthCurve& first, const DepthCurve& then);

/// What is wrong with it in words, empty when nothing is: entries that are not finite or beyond kMost, or that fall so
/// steeply that two readings mean one depth.
std::string validateDepthCurve(const DepthCurve& curve);

/// In place; 32FC1, 0 and NaN stay.
void applyDepthCurve(const DepthCurve& curve, cv::Mat* depth);

/// All that a camera's readings are added, and what its bearings mean.
struct CameraCorrection {
  double offset = 0;  ///< m, after the curve
  DepthCurve curve;
  BearingCorrection bearing;
  DepthShift shift;  ///< that depth was read with

  bool operator==(const CameraCorrection& other) const {
    return offset == other.offset && curve == other.curve && bearing == other.bearing && shift == other.shift;
  }
  bool operator!=(const CameraCorrection& other) const { return !(*this == other); }
};

/// From a depth that has one correction to the depth that has another.
class DepthChange {
 public:
  DepthChange(const CameraCorrection& from, const CameraCorrection& to);
  /// 0 is no depth and stays so, anything else stays before the camera.
  float operator()(float z) const;

 private:
  CameraCorrection from_, to_;
  bool same_curve_;
};

}  // namespace vip_slam
