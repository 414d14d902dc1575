// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/keyframes/keyframe_selector.h"

#include <algorithm>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

void KeyframeSelector::reset() { any_ = false; }

std::string KeyframeSelector::decide(double t, const SE3& T_odom_C, const std::vector<Feature>& features,
                                     double focal_px, bool still) const {
  if (!any_) return "first";
  if (still || t - t_ < options_.min_seconds) return "";

  const SE3 T_last_now = T_odom_C_.inverse() * T_odom_C;
  if (logSO3(T_last_now.rotation()).norm() / kDegree > options_.max_rotation_deg) return "rotation";
  if (median_depth_ > 0 && T_last_now.t().norm() > options_.max_translation_ratio * median_depth_) {
    return "translation";
  }
  int common = 0;
  double parallax = 0;
  const Eigen::Matrix3d R_last_now = T_last_now.R();
  for (const Feature& f : features) {
    const auto it = features_.find(f.id);
    if (it == features_.end()) continue;
    ++common;
    const Eigen::Vector3d p = R_last_now * f.xy.homogeneous().cast<double>();
    if (p.z() > 0.1) parallax += (p.head<2>() / p.z() - it->second.cast<double>()).norm() * focal_px;
  }
  // With a handful of features the ratio is not meaningful.
  const auto before = static_cast<double>(features_.size());
  if (before >= kEnough && common < options_.min_tracked_ratio * before) return "tracked ratio";
  if (common > 0 && parallax / common > options_.min_parallax_px) return "parallax";
  if (t - t_ > options_.max_seconds) return "time";
  return "";
}

void KeyframeSelector::accept(double t, const SE3& T_odom_C, const std::vector<Feature>& features) {
  any_ = true;
  t_ = t;
  T_odom_C_ = T_odom_C;
  features_.clear();
  std::vector<float> depths;
  for (const Feature& f : features) {
    if (f.id == kNoLandmark) continue;
    features_[f.id] = f.xy;
    if (f.depth > 0) depths.push_back(f.depth);
  }
  median_depth_ = depths.empty() ? 0 : upperMedian(std::move(depths));
}

}  // namespace vip_slam
