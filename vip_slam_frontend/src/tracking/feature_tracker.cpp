// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/feature_tracker.h"

#include <algorithm>

#include <opencv2/video/tracking.hpp>

#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/tracking/corner_detector.h"
#include "vip_slam_frontend/tracking/outlier_rejection.h"
#include "vip_slam_frontend/tracking/pixel_noise.h"

namespace vip_slam {

FeatureTracker::FeatureTracker(const TrackingOptions& options, std::shared_ptr<const CameraModel> camera,
                               const DepthNoise& noise, TimingLog* timing, const cv::Mat& mask, LandmarkId first_id)
    : options_(options),
      camera_(std::move(camera)),
      view_(camera_),
      noise_(noise),
      timing_(timing),
      mask_(mask),
      next_id_(first_id) {}

void FeatureTracker::clear() {
  tracks_.clear();
  ended_.clear();
  pyramid_.clear();
  last_pyramid_.clear();
  gray_ = cv::Mat();
  depth_ = cv::Mat();
}

TrackingResult FeatureTracker::track(const cv::Mat& gray, const cv::Mat& depth, const PredictedMotion& predicted,
                                     bool has_translation, const SE3& T_odom_C,
                                     const std::shared_ptr<const RowPoses>& rows, double t) {
  TrackingResult result;
  SE3 T_odom_here = T_odom_C;
  view_ = RowCamera(camera_, rows);
  ++image_count_;
  std::vector<cv::Point2f> next;
  std::vector<char> found;
  {
    ScopedTimer timer(timing_, "frontend.track", t);
    pyramid_.swap(last_pyramid_);
    pyramid_.clear();
    cv::buildOpticalFlowPyramid(gray, pyramid_, flowWindow(), kFlowLevels);
    if (!last_pyramid_.empty()) matchExposure(gray, predicted.T_current_previous, has_translation);
    if (!last_pyramid_.empty()) runKlt(gray, predicted.T_current_previous, has_translation, &next, &found);
    gray_ = gray;
    depth_ = depth;
    if (has_translation) findLost(predicted.T_current_previous, T_odom_C, &next, &found);
  }
  ended_.clear();
  if (tracks_.empty() || found.empty()) return result;

  ScopedTimer timer(timing_, "frontend.match", t);
  std::vector<std::size_t> index;
  const std::vector<PointPair> pairs = pairsOf(next, found, &index);
  RansacOptions ransac;
  ransac.threshold = kGateSigmas * kFlowSigma / camera_->focal();
  ransac.seed = image_count_;
  const RansacResult model = rejectOutliers(pairs, predicted, ransac, &result.moves_by_itself);
  result.lost_outlier = static_cast<int>(pairs.size()) - model.inliers;
  result.pose_ok = model.ok && model.with_depth;
  result.T_current_previous = model.T_current_previous;
  if (result.pose_ok) {
    result.motion = fitMotion(pairs, model.inlier, model.T_current_previous, 0.5 * ransac.threshold);
    // Aligned patches are warped by the prediction: where no IMU gives it, by what the points show.
    if (predicted.turn_unknown && result.motion.ok) {
      const SE3 T_odom_previous = T_odom_C * predicted.T_current_previous;
      T_odom_here = T_odom_previous * result.motion.T_current_previous.inverse();
    }
  }
  for (std::size_t k = 0; k < index.size() && predicted.judges; ++k) {
    result.regions.add({next[index[k]].x, next[index[k]].y}, pairs[k].depth_previous, model.inlier[k]);
  }
  keepInliers(index, model.inlier, next, predicted.T_current_previous);
  alignWithReferences(T_odom_here);
  for (Track& track : tracks_) measure(&track);
  result.tracked = static_cast<int>(tracks_.size());
  return result;
}

std::vector<PointPair> FeatureTracker::pairsOf(const std::vector<cv::Point2f>& next, const std::vector<char>& found,
                                               std::vector<std::size_t>* index) const {
  std::vector<PointPair> pairs;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (!found[i]) continue;
    const Feature& last = tracks_[i].feature;
    const double z = tracks_[i].carried_depth;
    const Eigen::Vector3d p = view_.unproject({next[i].x, next[i].y}, z > 0 ? z : kFarAway);
    PointPair pair{last.xy.cast<double>(), p.head<2>() / p.z(), z, static_cast<int>(last.age)};
    camera_->distort(pair.xy_current, &pair.pixels);
    pair.pixels /= camera_->focal();
    if (!(pair.pixels.determinant() > 1e-4)) pair.pixels.setIdentity();  // where the distortion is not invertible
    pairs.push_back(pair);
    index->push_back(i);
  }
  return pairs;
}

void FeatureTracker::keepInliers(const std::vector<std::size_t>& index, const std::vector<char>& inlier,
                                 const std::vector<cv::Point2f>& next, const SE3& T_current_previous) {
  std::vector<Track> kept;
  kept.reserve(index.size());
  for (std::size_t k = 0; k < index.size(); ++k) {
    if (!inlier[k]) continue;
    Track track = std::move(tracks_[index[k]]);
    track.feature.pixel = Eigen::Vector2f(next[index[k]].x, next[index[k]].y);
    ++track.feature.age;
    const Eigen::Vector3d last = track.carried_depth * track.feature.xy.homogeneous().cast<double>();
    if (track.carried_depth > 0) track.carried_depth = (T_current_previous * last).z();
    kept.push_back(std::move(track));
  }
  for (Track& track : tracks_) {
    if (track.reference) ended_.push_back(std::move(track));  // surviving tracks were moved out above
  }
  tracks_.swap(kept);
}

std::vector<std::size_t> FeatureTracker::replenish(const SE3& T_odom_C, bool force, double t) {
  std::vector<std::size_t> added;
  const int missing = options_.max_features - static_cast<int>(tracks_.size());
  // A corner search costs about as much as the tracking; a handful of missing features can wait.
  if (missing <= 0 || gray_.empty() || (!force && missing < options_.max_features / 8 && image_count_ % 4 != 0)) {
    return added;
  }
  ScopedTimer timer(timing_, "frontend.detect", t);
  std::vector<cv::Point2f> occupied;
  for (const Track& track : tracks_) occupied.emplace_back(track.feature.pixel.x(), track.feature.pixel.y());
  const std::shared_ptr<ReferenceImage> here = referenceHere(T_odom_C);
  for (const Corner& corner : detectCorners(gray_, occupied, missing, options_, mask_)) {
    Track track;
    track.feature.id = next_id_++;
    track.feature.pixel = Eigen::Vector2f(corner.pixel.x, corner.pixel.y);
    measure(&track.feature);
    setReference(&track, here);
    measure(&track);
    added.push_back(tracks_.size());
    tracks_.push_back(std::move(track));
  }
  return added;
}

}  // namespace vip_slam
