// SPDX-License-Identifier: BSD-3-Clause
#include "parts/rest.h"

#include <algorithm>
#include <map>

#include "vip_slam_core/util/statistics.h"
#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam::frontend {

std::optional<ResidualMotion> Rest::residualMotion() const {
  if (!still_) return std::nullopt;
  return detector_.residualMotion();
}

bool Rest::imuIsQuiet(const InertialInput& inertial, double since, double t_imu) const {
  since = std::max(inertial.oldest(), std::min(t_imu - kRestWindow, since));
  return imuSpread(inertial.between(since, t_imu), &noise_).quiet(options_.max_gyro_std, options_.max_accel_std);
}

void Rest::begin(const InertialInput& inertial, double t_imu, double seconds) {
  detector_.begin(imuSpread(inertial.between(t_imu - seconds, t_imu)));
}

double Rest::disparity(const PixelList& then, const PixelList& now) {
  const std::map<LandmarkId, Eigen::Vector2f> pixels(then.begin(), then.end());
  std::vector<float> moved;
  for (const auto& item : now) {
    const auto it = pixels.find(item.first);
    if (it != pixels.end()) moved.push_back((it->second - item.second).norm());
  }
  if (moved.size() < 5) return -1.0;
  return static_cast<double>(upperMedian(std::move(moved)));
}

void Rest::decide(const InertialInput& inertial, double previous_t_imu, double t_imu, const View& view) {
  still_ = isStill(inertial, previous_t_imu, t_imu, view);
}

bool Rest::isStill(const InertialInput& inertial, double previous_t_imu, double t_imu, const View& view) {
  // Back to the last image at least: in a longer gap between images the camera may have moved and stopped again.
  const double since = std::max(inertial.oldest(), std::min(t_imu - kRestWindow, previous_t_imu));
  // An image alone does not tell standing from a wall that moves along.
  if (!inertial.measured(since, t_imu)) return false;
  PixelList now;
  for (const Track& track : *view.tracks) now.emplace_back(track.feature.id, track.feature.pixel);
  StillnessCues cues;
  cues.imu = imuSpread(inertial.between(since, t_imu), &noise_);
  cues.tracks = view.counts ? static_cast<int>(now.size()) : 0;
  cues.speed = view.speed;
  cues.sigma_velocity = view.sigma_velocity;
  cues.sigma_px = view.sigma_px;
  cues.px_per_radian = view.px_per_radian;
  cues.px_per_metre = view.px_per_metre;
  while (recent_pixels_.size() > 1 && t_imu - recent_pixels_[1].first >= kRestWindow - 1e-6) {
    recent_pixels_.pop_front();
  }
  const bool old = !recent_pixels_.empty() && t_imu - recent_pixels_.front().first >= kRestWindow - 1e-6;
  if (old) cues.disparity_px = disparity(recent_pixels_.front().second, now);
  if (still_ && view.counts) cues.anchor_disparity_px = disparity(anchor_, now);
  recent_pixels_.emplace_back(t_imu, now);
  const bool still = detector_.update(cues);
  // Without features in common with the anchor image (the lights went out) the motion since it is unknown: renew it.
  const bool anchor_gone = still_ && cues.anchor_disparity_px < 0 && cues.tracks > kEnough;
  if (still && (!still_ || anchor_gone)) anchor_ = std::move(now);
  return still;
}

void Rest::reset() {
  detector_.reset();
  still_ = false;
  recent_pixels_.clear();
  anchor_.clear();
}

}  // namespace vip_slam::frontend
