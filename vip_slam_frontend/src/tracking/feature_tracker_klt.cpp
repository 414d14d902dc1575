// SPDX-License-Identifier: BSD-3-Clause
// The feature tracker's optical flow: predicted starts, exposure, forward-backward check.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/video/tracking.hpp>

#include "vip_slam_core/util/statistics.h"
#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"
#include "vip_slam_frontend/tracking/pixel_noise.h"

namespace vip_slam {

namespace {

Eigen::Vector2d asVector(const cv::Point2f& p) { return {p.x, p.y}; }

struct Brightness {
  double mean, deviation;  ///< grey levels
};

/// Of the wide patch around a pixel, which lies in the image. For patches as small as this cv::meanStdDev takes
/// four to six times as long.
Brightness brightnessAround(const cv::Mat& gray, const Eigen::Vector2d& uv) {
  constexpr int side = 2 * kWidePatch + 1, n = side * side;
  int sum = 0, squares = 0;
  for (int y = 0; y < side; ++y) {
    const auto* row = gray.ptr<std::uint8_t>(cvRound(uv.y()) - kWidePatch + y) + cvRound(uv.x()) - kWidePatch;
    for (int x = 0; x < side; ++x) {
      sum += row[x];
      squares += row[x] * row[x];
    }
  }
  const double mean = static_cast<double>(sum) / n;
  return {mean, std::sqrt(std::max(0.0, static_cast<double>(squares) / n - mean * mean))};
}

}  // namespace

bool FeatureTracker::predictMotion(const Track& track, const SE3& predicted, bool has_translation,
                                   Eigen::Vector2d* uv) const {
  const double z = has_translation && track.carried_depth > 0 ? track.carried_depth : kFarAway;
  const Eigen::Vector3d p = predicted.R() * (track.feature.xy.homogeneous().cast<double>() * z) +
                            (has_translation ? predicted.t() : Eigen::Vector3d(Eigen::Vector3d::Zero()));
  return view_.project(p, uv) && camera_->inImage(*uv);
}

void FeatureTracker::matchExposure(const cv::Mat& gray, const SE3& predicted, bool has_translation) {
  std::vector<double> gains, contrasts, last, now;
  for (const Track& track : tracks_) {
    const Eigen::Vector2d here = track.feature.pixel.cast<double>();
    Eigen::Vector2d there;
    if (!predictMotion(track, predicted, has_translation, &there)) continue;
    if (!camera_->inImage(here, kWidePatch + 1) || !camera_->inImage(there, kWidePatch + 1)) continue;
    const Brightness patch_last = brightnessAround(gray_, here), patch = brightnessAround(gray, there);
    if (patch_last.deviation < 2.0 || patch.deviation < 1.0) continue;
    gains.push_back(patch.deviation / patch_last.deviation);
    contrasts.push_back(patch_last.deviation);
    last.push_back(patch_last.mean);
    now.push_back(patch.mean);
  }
  if (gains.size() < kEnough) return;
  const double gain = upperMedian(gains);
  std::vector<double> offsets, changes;
  for (std::size_t i = 0; i < gains.size(); ++i) {
    offsets.push_back(now[i] - gain * last[i]);
    changes.push_back(now[i] - last[i]);
  }
  // Brightness constancy holds while contrast and brightness change by less than the noise of a grey level.
  if (std::abs(gain - 1.0) * upperMedian(contrasts) < kGreySigma && std::abs(upperMedian(changes)) < kGreySigma) return;
  const double offset = upperMedian(offsets);
  cv::Mat adapted;
  gray_.convertTo(adapted, CV_8U, gain, offset);
  last_pyramid_.clear();
  cv::buildOpticalFlowPyramid(adapted, last_pyramid_, flowWindow(), kFlowLevels);
}

void FeatureTracker::runKlt(const cv::Mat& gray, const SE3& predicted, bool has_translation,
                            std::vector<cv::Point2f>* next, std::vector<char>* found) {
  std::vector<cv::Point2f> previous;
  previous.reserve(tracks_.size());
  next->clear();
  for (const Track& track : tracks_) {
    const Feature& f = track.feature;
    previous.emplace_back(f.pixel.x(), f.pixel.y());
    Eigen::Vector2d uv;
    const bool usable = predictMotion(track, predicted, has_translation, &uv);
    next->push_back(usable ? cv::Point2f(static_cast<float>(uv.x()), static_cast<float>(uv.y())) : previous.back());
  }
  found->assign(tracks_.size(), 0);
  if (tracks_.empty()) return;

  const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 0.01);
  std::vector<std::uint8_t> status, back_status;
  cv::calcOpticalFlowPyrLK(last_pyramid_, pyramid_, previous, *next, status, cv::noArray(), flowWindow(), kFlowLevels,
                           criteria, cv::OPTFLOW_USE_INITIAL_FLOW, 1e-4);
  // Backward check from the forward result, started at the previous pixel: one pyramid level is enough. It may be off
  // by the flow's sigma.
  std::vector<cv::Point2f> back = previous;
  cv::calcOpticalFlowPyrLK(pyramid_, last_pyramid_, *next, back, back_status, cv::noArray(), flowWindow(), 1, criteria,
                           cv::OPTFLOW_USE_INITIAL_FLOW, 1e-4);
  for (std::size_t i = 0; i < previous.size(); ++i) {
    const cv::Point2f d = back[i] - previous[i];
    const Eigen::Vector2d uv = asVector((*next)[i]);
    (*found)[i] = status[i] && back_status[i] && std::hypot(d.x, d.y) < kFlowSigma && uv.allFinite() &&
                  uv.x() >= options_.border && uv.y() >= options_.border && uv.x() < gray.cols - options_.border &&
                  uv.y() < gray.rows - options_.border && allowed(uv);
  }
}

}  // namespace vip_slam
